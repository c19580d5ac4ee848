//! Which rays meet a prim.

/// Which rays meet a prim that gives light. All do, unless a file says otherwise.
///
/// A light that is hidden is sampled all the same: it lights what it lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Visibility {
    /// Rays from the camera. Those that do not meet it see what is behind it.
    pub camera: bool,
    /// Rays that a surface reflects. Light from a prim that they do not meet is found by sampling
    /// the light alone.
    pub reflections: bool,
    /// Rays from a surface to a light. What they do not meet casts no shadow; a reflected ray that
    /// meets it takes up its light and goes on, for it too must find what is behind.
    pub shadows: bool,
}

impl Visibility {
    /// An ordinary surface.
    pub const ALL: Visibility = Visibility { camera: true, reflections: true, shadows: true };
    /// A shape that stands for a light alone.
    pub const LAMP: Visibility = Visibility { camera: false, reflections: true, shadows: false };
}

impl Default for Visibility {
    fn default() -> Self {
        Visibility::ALL
    }
}
