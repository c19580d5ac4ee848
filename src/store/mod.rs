//! Floor 1: bytes on disk.

pub mod atomic;
