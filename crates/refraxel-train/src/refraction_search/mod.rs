//! How a model comes to bend its rays: find what is refractive, search its index, and clear what straight rays left
//! inside.
//!
//! At this point straight rays have learned everything that is seen beside the refractive things. Then:
//! 1. Views say where refractive things can be (`find`): the visual hull of the masks, a box, or a known index.
//! 2. Each hypothesis on what stands there (`hypotheses`) has some unknown numbers, first of all the index. They are scanned by
//!    prediction without training (`look`, `revolve`): the scene around is known by now, so the right index shows it in the right
//!    places. Views that were kept aside say whether rays bend there (`opinion`, `predicted`).
//! 3. What is seen through a body alone no prediction can show. Where it stays open, the usual bodies race against straight rays
//!    (`race`, `trials`), and views that were kept aside judge. A region in which straight rays are as good stays straight.
//! 4. Haze that straight rays left inside is cleared.
//!
//! From there shape and index learn by their gradients, first alone and then together with everything else.

mod baseline;
mod begin;
mod border;
mod check;
mod completing;
mod context;
mod decide;
mod facets;
mod find;
mod ground;
mod hull;
mod hypotheses;
mod initial;
mod known;
mod look;
mod mirrors;
mod misfit;
mod opinion;
mod outline;
mod parts;
mod predicted;
mod race;
mod region;
mod revolve;
mod shapes;
mod silhouettes;
mod state;
mod surface;
mod tint;
mod trials;

pub(crate) use baseline::{baseline, proof};
pub use begin::begin;
pub(crate) use border::{MASK_MARGIN, border};
pub use check::{check, has_masks, is_told};
pub use completing::LEAST as LEAST_MASKS;
pub(crate) use completing::hulls;
pub use context::{Context, Decision, SearchError};
pub(crate) use ground::Ground;
pub use known::{known_field, known_refraction};
pub(crate) use mirrors::bake_probes;
pub(crate) use outline::{Outline, outline};
pub(crate) use parts::{NONE, connected, neighbours};
pub(crate) use silhouettes::OCCLUDER_RAYS;
