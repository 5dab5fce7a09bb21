//! Procedural solid textures with detail at several scales, so that refraction of them is easy to see.
//!
//! A texture is a function of the world position. Its value is the basic radiance L/n², linear and without unit: a
//! surface under water shows the colour that it shows in air, and no index change along a ray adds a factor.

mod any_texture;
mod color;
mod letters;
mod mosaic;
mod noise;
mod paint;
mod picture;
mod surface;

pub use any_texture::Texture;
pub use color::Rgb;
pub(super) use color::{rgb, srgb_from_linear};
pub use mosaic::Mosaic;
pub(super) use noise::noise;
pub use paint::{Paint, Tiles};
pub use picture::Picture;
pub use surface::{Face, Lamp, Panel, Surface};
