//! Signals: what stops a job.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

/// The exit code of a job that a signal has stopped is this and the signal's number, as a shell has it.
pub const STOPPED: u8 = 128;

/// The signal that asked for a stop, if one did.
#[derive(Clone)]
pub struct Stop(Arc<AtomicUsize>);

impl Stop {
    /// Listens for [`signals`]. The first is noticed; a second one ends the process at once, with the same code.
    pub fn listen() -> io::Result<Stop> {
        let (signal, again) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        for number in signals() {
            // In this order: the first signal does not yet find the flag set.
            // A terminal that closes sends SIGHUP twice.
            if number != SIGHUP {
                flag::register_conditional_shutdown(number, 128 + number, again.clone())?;
            }
            flag::register(number, again.clone())?;
            flag::register_usize(number, signal.clone(), number as usize)?;
        }
        Ok(Stop(signal))
    }

    /// The number of the signal.
    pub fn signal(&self) -> Option<u8> {
        u8::try_from(self.0.load(Relaxed)).ok().filter(|&signal| signal > 0)
    }
}

/// The signals that stop a job: Ctrl-C, also where a shell has made the process deaf to it (`&` in a script); SIGTERM;
/// and SIGHUP, unless `nohup` has made the process deaf to that.
pub fn signals() -> impl Iterator<Item = i32> {
    let is_deaf = std::fs::read_to_string("/proc/self/status")
        .is_ok_and(|status| is_ignored(&status, SIGHUP));
    [SIGINT, SIGTERM, SIGHUP].into_iter().filter(move |&number| number != SIGHUP || !is_deaf)
}

/// Whether a process with this `/proc/PID/status` ignores a signal.
fn is_ignored(status: &str, number: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (number - 1) & 1 == 1)
}
