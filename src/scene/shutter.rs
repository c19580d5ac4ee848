//! When a camera's shutter is open: motion blur.
//!
//! What a shutter sees is the mean over the time that it is open. A frame is posed at some of its times, as many as
//! the scene's size allows, and every sample of a pixel is taken at one of them (Cook, Porter and Carpenter 1984).
//! The times are the scene's and the frame's alone, so that a light tree can be built that holds all of them. A camera
//! that moves by itself sees more of them, for that costs nothing.

use super::{Camera, Scene};

/// A frame has so many times at most...
const MOST_TIMES: usize = 128;
/// ...and so many at least...
const FEWEST_TIMES: usize = 8;
/// ...for so many poses of instances, lights, and triangles of mesh lights that move and of meshes that deform, in all.
const MOST_POSES: usize = 1 << 21;

/// When a shutter is open, in frames from the frame that is rendered on. It is open for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shutter {
    /// It opens then.
    open: f64,
    /// It closes then.
    close: f64,
}

impl Shutter {
    /// A shutter that opens and closes at two times; `None` if that leaves it closed.
    pub fn new(open: f64, close: f64) -> Option<Shutter> {
        (open < close && (close - open).is_finite()).then_some(Shutter { open, close })
    }

    /// The times at which a camera sees a frame in which nothing else moves, as frame numbers.
    pub fn times_of_view(self, frame: i32) -> Vec<f64> {
        self.times(frame, MOST_TIMES).collect()
    }

    /// The middles of equal parts of the time that it is open, as frame numbers.
    fn times(self, frame: i32, parts: usize) -> impl Iterator<Item = f64> {
        let part = (self.close - self.open) / parts as f64;
        (0..parts).map(move |i| f64::from(frame) + self.open + (i as f64 + 0.5) * part)
    }
}

impl Scene {
    /// The times at which a camera sees a frame, as frame numbers, ascending: those of its shutter, or the frame
    /// alone if it has none.
    pub fn times_of(&self, camera: &Camera, frame: i32) -> Vec<f64> {
        match camera.shutter {
            Some(shutter) => shutter.times(frame, self.times_of_a_frame()).collect(),
            None => vec![frame.into()],
        }
    }

    /// The times at which any of the scene's cameras sees a frame, with its shutter or without: the frame comes
    /// first.
    pub fn times_of_all(&self, frame: i32) -> Vec<f64> {
        let mut times = vec![frame.into()];
        let shutters = self.shutters();
        // Counting what moves is for those who have a shutter.
        if !shutters.is_empty() {
            let parts = self.times_of_a_frame();
            times.extend(shutters.into_iter().flat_map(|shutter| shutter.times(frame, parts)));
        }
        times
    }

    /// The shutters of the scene's cameras, each once.
    pub fn shutters(&self) -> Vec<Shutter> {
        let mut shutters = Vec::new();
        for shutter in self.cameras.iter().filter_map(|camera| camera.shutter) {
            if !shutters.contains(&shutter) {
                shutters.push(shutter);
            }
        }
        shutters
    }

    /// A power of two. Cameras and nodes do not count: a view that is added changes no picture.
    fn times_of_a_frame(&self) -> usize {
        let moving = self.moving_nodes();
        let shines = |row: u32| self.peak_rgb_of_instance(row).max_element() > 0.0;
        let posed_by_triangle = (0..).zip(&self.instances).filter(|&(row, instance)| {
            self.deforms(row) || (moving[instance.node as usize] && shines(row))
        });
        let triangles =
            posed_by_triangle.map(|(_, row)| self.meshes[row.mesh as usize].triangles.len());
        let posed = self.instances.len() + self.lights.len() + triangles.sum::<usize>();
        let times = (MOST_POSES / posed.max(1)).clamp(FEWEST_TIMES, MOST_TIMES);
        1 << times.ilog2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_the_middles_of_equal_parts() {
        let mut scene = Scene::default();
        let mut camera = Camera::perspective(0, 1.0);
        assert_eq!(scene.times_of(&camera, 7), [7.0]);
        camera.shutter = Shutter::new(-0.25, 0.75);
        let times = scene.times_of(&camera, 7);
        assert_eq!(times.len(), MOST_TIMES);
        assert_eq!(camera.shutter.map(|shutter| shutter.times_of_view(7)), Some(times.clone()));
        assert_eq!(times[0], 6.75 + 0.5 / 128.0);
        assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 1.0 / 128.0).abs() < 1e-12));
        // A second camera of the same shutter adds none; that of another one does.
        scene.cameras = vec![camera.clone(), camera.clone()];
        assert_eq!(scene.times_of_all(7), [&[7.0], &*times].concat());
        scene.cameras.push(Camera { shutter: Shutter::new(0.0, 0.5), ..camera });
        assert_eq!(scene.times_of_all(7).len(), 1 + 2 * MOST_TIMES);
    }

    #[test]
    fn a_shutter_is_open_for_a_while() {
        for (open, close) in
            [(0.5, 0.5), (0.5, 0.0), (f64::NAN, 1.0), (0.0, f64::NAN), (0.0, f64::INFINITY)]
        {
            assert_eq!(Shutter::new(open, close), None, "{open} {close}");
        }
    }
}
