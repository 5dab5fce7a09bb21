//! The search for the first index and its profile.

use super::Switch;
use super::section::section;
use super::value::choice;

choice! {
    /// How the index changes from the outside of a refractive body to its inside.
    pub enum SurfaceProfile {
        /// The program takes the profile that fits the training images best.
        Auto = "auto",
        /// It jumps at a surface, which is the level set of a function.
        Sharp = "sharp",
        /// It changes smoothly over some voxels.
        Smooth = "smooth",
        /// It rises from 1 at the hull to the middle, as in a lens with an index gradient.
        Graded = "graded",
    }
}

section! {
    /// The search for what stands in each region, its index and its measures, by the error of the rendered rays.
    pub struct SearchOptions "search" {
        /// Whether the first index is searched. Otherwise it is `guess`.
        enabled: Switch = Switch::On;
        /// Index of refraction to start from without a search.
        guess: f32 = 1.4, in 1.0..=4.0;
        /// How the index changes from the outside of a refractive body to its inside.
        profile: SurfaceProfile = SurfaceProfile::Auto;
        /// Whether open vessels and water that is seen from above only are tried, too, where no other hypothesis explains what is
        /// seen. They take some seconds per region.
        rare: Switch = Switch::On;
        /// Rays that judge a candidate, per region.
        rays: u32 = 4096, in 64..=65_536, "rays";
        /// Squared error, over the three channels, that counts half: rays that end at something unknown must not decide.
        saturation: f64 = 0.01, in 1e-6..=1.0;
        /// Hypotheses whose search takes long are tried where no other lowers the error of straight rays to this part.
        explained: f64 = 0.93, in 0.0..=1.0;
        /// After its first pass a hypothesis is searched further if it has at most this factor of the least error of any.
        far: f64 = 1.06, in 1.0..=10.0;
        /// A hypothesis with more unknowns must lower the error to this part of that of a solid body.
        better: f64 = 0.985, in 0.5..=1.0;
        /// What is seen through a body has its colour from the body, not from what stands behind, where that lowers the error to
        /// this part.
        tinted: f64 = 0.97, in 0.0..=1.0;
        /// Most things are of water, glass or plastic: the index that needs no evidence.
        usual_index: f64 = 1.42, in 1.0..=4.0;
        /// An index this far from the usual one must fit better by a part of `unusual`; twice as far, by four.
        usual_spread: f64 = 0.25, in 0.01..=4.0;
        /// A surface this far off the visual hull must fit better by a part of `unusual` [voxel]; twice as far, by four.
        usual_offset: f64 = 1.4, in 0.01..=100.0, "voxels";
        /// See `usual_spread`. It decides where the error hardly depends on the index, and nowhere else.
        unusual: f64 = 0.002, in 0.0..=1.0;
    }
}
