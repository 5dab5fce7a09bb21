//! Names of the time when all options were one flat list. Scripts and stored runs still use them.

/// An option that had another name.
pub(super) struct Former {
    pub(super) name: &'static str,
    /// Its full name today.
    pub(super) now: &'static str,
}

/// An option that is gone.
pub(super) struct Removed {
    pub(super) name: &'static str,
    /// The value with which it did nothing; `None` where no value matters once a run has begun. Stored runs with it can be
    /// used as before.
    pub(super) idle: Option<&'static str>,
    /// What it did, and what to do now.
    pub(super) advice: &'static str,
}

const fn former(name: &'static str, now: &'static str) -> Former {
    Former { name, now }
}

const fn removed(name: &'static str, idle: &'static str, advice: &'static str) -> Removed {
    Removed { name, idle: Some(idle), advice }
}

/// What is not here had its present key as its name: `steps` is `run.steps`.
pub(super) const FORMER: [Former; 56] = [
    former("resolution", "grid.resolution"),
    former("voxels_per_pixel", "grid.voxels_per_pixel"),
    former("train_step", "march.step"),
    former("bent_tv", "field.tv_density_refractive"),
    former("environment_rows", "field.background_rows"),
    former("refraction", "refraction.bend"),
    former("refraction_box", "refraction.bounds"),
    former("index_share", "refraction.index_alone_share"),
    former("inside_share", "refraction.mask_ray_fraction"),
    former("inside_share_decay", "refraction.mask_ray_decay"),
    former("index_shape", "shape.start"),
    former("index_vote", "shape.vote"),
    former("index_faces", "shape.faces"),
    former("index_smooth", "shape.smooth"),
    former("index_gate", "shape.gate"),
    former("index_interior", "shape.interior"),
    former("index_resolution", "shape.resolution"),
    former("index_voxels_per_pixel", "shape.voxels_per_pixel"),
    former("index_scan", "search.enabled"),
    former("index_guess", "search.guess"),
    former("index_surface", "search.profile"),
    former("rate_index", "index.rate"),
    former("index_blur", "index.blur"),
    former("index_clip", "index.clip"),
    former("index_largest", "index.largest"),
    former("index_trust", "index.trust"),
    former("index_interpolation", "index.interpolation"),
    former("index_stepping", "index.integrator"),
    former("index_step", "index.step"),
    former("index_variation", "index.variation"),
    former("index_variation_penalty", "index.variation_penalty"),
    former("index_deviation", "index.deviation"),
    former("index_deviation_penalty", "index.deviation_penalty"),
    former("rate_surface", "surface.rate"),
    former("surface_blur", "surface.blur"),
    former("surface_smooth", "surface.smooth"),
    former("surface_coarsening", "surface.coarsening"),
    former("surface_events", "surface.events"),
    former("reflection", "reflection.enabled"),
    former("reflection_weight", "reflection.weight"),
    former("reflection_cache", "reflection.cache"),
    former("reflection_probes", "reflection.probes"),
    former("reflection_degree", "reflection.degree"),
    former("reflection_bake", "reflection.bake_period"),
    former("rate_reflection", "reflection.rate"),
    former("rate_strength", "reflection.rate_strength"),
    former("clearcoat", "clearcoat.enabled"),
    former("clearcoat_index", "clearcoat.index"),
    former("clearcoat_start", "clearcoat.start"),
    former("clearcoat_probes", "clearcoat.probes"),
    former("rate_clearcoat", "clearcoat.rate"),
    former("gloss", "clearcoat.enabled"),
    former("gloss_index", "clearcoat.index"),
    former("gloss_start", "clearcoat.start"),
    former("gloss_probes", "clearcoat.probes"),
    former("rate_gloss", "clearcoat.rate"),
];

const SOFT_EDGE: &str =
    "surfaces begin sharp, without a soft edge; leave it out, and train a run that had one again";

pub(super) const REMOVED: [Removed; 8] = [
    Removed { name: "index_from", idle: None, advice: "name the file with --index-from" },
    Removed {
        name: "seek.pause",
        idle: None,
        advice: "glass is sought before the run, in a time of its own; leave it out, and use `seek.rays` and `seek.cost`",
    },
    removed("surface_width", "0", SOFT_EDGE),
    removed("surface_width_share", "0.3", SOFT_EDGE),
    removed(
        "surface_bending",
        "0",
        "the bending energy of surfaces did not improve results; leave it out, use `surface.smooth`, and train a run that \
         had it again",
    ),
    removed(
        "index_stages",
        "1",
        "the index has its final resolution from the start; leave it out, and train a run that had stages again",
    ),
    removed(
        "index_period",
        "1",
        "the index learns in every step; leave it out, and train a run that had another period again",
    ),
    removed(
        "bent_rates",
        "1",
        "density and colour keep their rates where rays bend; leave it out, use `field.rate_density` and \
         `field.rate_colour`, and train a run that had it again",
    ),
];
