//! The scenes, named for what they show.

mod catalogue;
mod choice;
mod graded;
mod rooms;
mod sharp;
mod surroundings;
mod water;

pub use catalogue::{scene, scene_list};
pub use choice::{IorRange, SceneInfo, SceneOptions};
pub use rooms::{Room, room, room_list};
