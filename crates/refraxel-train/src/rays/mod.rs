//! Training rays: which pixel of which photograph, its ray and what it should show.

mod batch;
mod draw;
mod edition;
mod inside;
mod lanes;
mod picture;
mod pixel;
mod sampler;
mod selection;
mod shown;
#[cfg(test)]
mod tests;
mod view;

pub use batch::Batch;
pub use draw::Draw;
pub use edition::Edition;
pub use lanes::{LANES, MOVE_LANES, OFFSET_LANE, PIXEL_LANE, REDRAWS};
pub(crate) use picture::cells;
pub use picture::{Directions, Picture};
pub use pixel::{pixel_ray, pixel_size, ray_within};
pub use sampler::{AsideView, MaskedView, RaySampler};
pub use selection::Selection;
pub use shown::{WHITE, over, shown, squared_errors};
pub use view::{TAPS, is_used};
