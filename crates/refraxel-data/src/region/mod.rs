//! Where the scene is: a box from cameras, points and pictures, so that the user need not draw one.

mod axes;
mod border;
mod content;
mod forward;
mod quantile;
mod scale;
mod scene;

pub use quantile::quantile;
pub use scale::{OutOfScale, check_scale};
pub(crate) use scene::unseen;
pub use scene::{Region, scene_region, sees_box};
