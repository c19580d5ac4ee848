//! At which times the keys are of what several animations say together.
//!
//! What is made of several tracks, or of a spline, is between keys what no keys can say: it is told at all their keys and
//! at each frame, linear in between. Where a track jumps there are two keys.

use crate::scene::{Blend, Interpolation, Keys, Timeline};

/// Keys are put at so many frames at most.
const MOST_FRAMES: f64 = 100_000.0;

/// When a track has keys, and what holds between them.
pub(super) type Beats<'a> = (&'a [f32], Interpolation);

/// So many keys are made of these tracks at most.
pub(super) fn most_keys<'a>(tracks: impl Iterator<Item = &'a [f32]>, timeline: Timeline) -> usize {
    let (mut own, mut first, mut last) = (0, f64::MAX, f64::MIN);
    for times in tracks {
        own += times.len();
        for time in times.iter().map(|&time| f64::from(time)) {
            (first, last) = (first.min(time), last.max(time));
        }
    }
    let frames = timeline.frame_at(last) - timeline.frame_at(first);
    // Two of each that jumps.
    2 * own + frames.clamp(0.0, MOST_FRAMES) as usize
}

/// The times of what tracks say together, and what holds between them. There must be a track.
pub(super) fn times(tracks: &[Beats], timeline: Timeline) -> (Vec<f32>, Interpolation) {
    let mut times: Vec<f32> = tracks.iter().flat_map(|(times, _)| times.iter().copied()).collect();
    times.sort_by(f32::total_cmp);
    let is_held = tracks.iter().all(|(_, how)| *how == Interpolation::Step);
    if !is_held {
        let (first, last) = (times[0], times[times.len() - 1]);
        let frame = |second: f32| timeline.frame_at(second.into());
        let count = (frame(last) - frame(first)).clamp(0.0, MOST_FRAMES) as u32;
        let frames = (0..=count).map(|i| frame(first).ceil() + f64::from(i));
        let seconds = frames.map(|frame| timeline.seconds_at(frame) as f32);
        times.extend(seconds.filter(|&second| second > first && second < last));
        // Where a part jumps there are two keys.
        for (jumps, _) in tracks.iter().filter(|(_, how)| *how == Interpolation::Step) {
            times.extend(jumps.iter().skip(1).map(|time| time.next_down()));
        }
        times.sort_by(f32::total_cmp);
    }
    times.dedup();
    (times, if is_held { Interpolation::Step } else { Interpolation::Linear })
}

/// The same keys, those that count as at a frame exactly at it: a part that jumps there jumps with the others.
pub(super) fn on_frames<T: Clone>(keys: &Keys<T>, timeline: Timeline) -> Keys<T> {
    let time = |&time: &f32| {
        let frame_s = timeline.seconds_at(timeline.frame_at(time.into()).round());
        if timeline.is_same(time.into(), frame_s) { frame_s as f32 } else { time }
    };
    Keys { times_s: keys.times_s.iter().map(time).collect(), ..keys.clone() }
}

/// The value at one of these times. Where a track jumps it is the last key's, exactly, not as near as frames are.
pub(super) fn value<T: Blend>(keys: &Keys<T>, time: f32, timeline: Timeline) -> T::Exact {
    if keys.interpolation != Interpolation::Step {
        return keys.at(time.into(), timeline);
    }
    let after = keys.times_s.partition_point(|&key| key <= time);
    keys.values[after.saturating_sub(1)].exact()
}
