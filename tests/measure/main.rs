//! The trade of speed against accuracy, as `candelabra::measure` finds it.

mod golden;
mod scenes;
#[allow(dead_code)]
#[path = "../render/stage.rs"]
mod stage;
mod trade;
