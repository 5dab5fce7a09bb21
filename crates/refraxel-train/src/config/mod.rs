//! Training options: everything that `--set key=value` and a configuration file can change.

mod choices;

pub use choices::{
    Bending, IndexInterpolation, IndexPenalty, IndexShape, ReflectionCache, ReflectionWeight, Stepping,
    Surface, Switch,
};
use refraxel_core::{Aabb, vec3};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// What training should do. Every field is a key of the configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Steps in all; ignored when `minutes` is set.
    pub steps: u64,
    /// Stop after this many steps as if interrupted, saved and ready to be resumed; 0: never.
    pub stop_after: u64,
    /// Wall-clock budget [minute]; 0: train for `steps` instead. A clock is not reproducible, steps are.
    pub minutes: f64,
    /// Rays of a step.
    pub batch: u32,
    /// Angular degree of colour, 0 to 3.
    pub sh_degree: u8,
    /// Nodes along the longest edge of the final grid; 0: by `voxels_per_pixel`.
    pub resolution: u32,
    /// Voxels per pixel at the centre of the scene.
    pub voxels_per_pixel: f64,
    /// Largest resolution that is chosen automatically.
    pub max_resolution: u32,
    /// Number of coarse-to-fine stages, theory (4.9); each doubles the resolution.
    pub stages: u32,
    /// Share of the run that each stage before the last takes, of what is then left.
    pub stage_share: f64,
    /// Quadrature step while training [voxel].
    pub train_step: f32,
    /// Quadrature step of final renderings [voxel].
    pub render_step: f32,
    /// Nothing nearer to any camera is seen than this share of the distance from the scene's centre to the nearest
    /// camera.
    pub near: f32,
    /// Samples with an optical depth per voxel below this are transparent.
    pub min_optical_depth: f32,
    /// Rays stop at this transmittance.
    pub min_transmittance: f32,
    /// Learning rate of raw density at the start, theory (4.8).
    pub rate_density: f32,
    /// Learning rate of SH coefficients at the start.
    pub rate_colour: f32,
    /// Learning rate of the background at the start.
    pub rate_background: f32,
    /// Factor that all rates have reached at the end.
    pub rate_decay: f32,
    /// Share of the run over which rates rise from a tenth.
    pub warm_up: f32,
    /// Where rays bend: share of the run over which the rate of what depends on the direction rises from 0 to that of all
    /// colour, theory (4.8); 0: none.
    pub view_warm_up: f32,
    /// Raw density everywhere at the start.
    pub initial_density: f32,
    /// Weight of the Cauchy sparsity prior per sample.
    pub sparsity: f32,
    /// Weight of the opacity prior per ray.
    pub opacity: f32,
    /// Weight of total variation of density.
    pub tv_density: f32,
    /// Weight of total variation of colour.
    pub tv_colour: f32,
    /// Factor that the weights of total variation have reached at the end.
    pub tv_decay: f32,
    /// Total variation visits this fraction (one in n) of the voxels in one step.
    pub tv_period: u32,
    /// Voxels that no training ray gives more weight than this are dropped.
    pub prune_weight: f32,
    /// Rows of the learned panorama behind unbounded scenes.
    pub environment_rows: u32,
    /// Largest estimated memory of parameters and moments [GiB]; the resolution is lowered to fit.
    pub memory: f64,
    /// Whether rays bend.
    pub refraction: Bending,
    /// Box that holds everything refractive, `x0,y0,z0,x1,y1,z1` [scene unit]; empty: where the masks say.
    pub refraction_box: String,
    /// Steps that learn what lies outside the masks, with straight rays; at most a quarter of the run.
    pub straight_steps: u64,
    /// Share of the run that then learns the index alone.
    pub index_share: f64,
    /// Least share of in-mask rays in a batch when rays begin to bend.
    pub inside_share: f64,
    /// Factor on it that is reached, evenly, at the end of the run.
    pub inside_share_decay: f64,
    /// What the index looks like before it learns.
    pub index_shape: IndexShape,
    /// What the surface of the shape is.
    pub index_surface: Surface,
    /// File that `index_shape = file` reads: scene.json, an index volume, or a mesh.
    pub index_from: String,
    /// Whether the first index inside is searched by the error of the rendered rays; else it is `index_guess`.
    pub index_scan: Switch,
    /// Index of refraction to start from without a search.
    pub index_guess: f32,
    /// Share of the views that must agree that a point is refractive.
    pub index_vote: f32,
    /// Whether bulges of a hull that no silhouette shows are cut off by planes.
    pub index_faces: Switch,
    /// Blur of the first shape [voxel of the index grid].
    pub index_smooth: f32,
    /// Nodes along the longest edge of a region; 0: by `index_voxels_per_pixel`.
    pub index_resolution: u32,
    /// Index voxels per pixel at a region.
    pub index_voxels_per_pixel: f64,
    /// How the index is interpolated.
    pub index_interpolation: IndexInterpolation,
    /// How rays are integrated.
    pub index_stepping: Stepping,
    /// Step through the index [voxel of the index grid].
    pub index_step: f32,
    /// Whether only rays bend that would meet the object on a straight line.
    pub index_gate: Switch,
    /// Whether the index inside the shape is free, not only at its surface.
    pub index_interior: Switch,
    /// Learning rate of the index; 0 holds it fixed.
    pub rate_index: f32,
    /// Edge length of the voxels on which the nodes of a sharp surface learn, in those on which it was found.
    pub surface_coarsening: f32,
    /// Learning rate of a sharp surface [voxel of its grid]; 0 holds it fixed.
    pub rate_surface: f32,
    /// Blur of the gradient of a sharp surface [voxel of the index grid].
    pub surface_blur: f32,
    /// Smoothing of a sharp surface per step, 0 to 1; none where the surface is held fixed.
    pub surface_smooth: f32,
    /// Sharp surfaces learn only from rays that meet them at most this often.
    pub surface_events: u32,
    /// Blur of the gradient of the index [voxel of the index grid].
    pub index_blur: f32,
    /// Bound on the gradient of one kick.
    pub index_clip: f32,
    /// Largest index that can be learned.
    pub index_largest: f32,
    /// The one index of a sharp body stays this near to what the search found: where its shape is wrong, a gradient would
    /// carry it away.
    pub index_trust: f32,
    /// Weight of the variation of the index.
    pub index_variation: f32,
    /// Penalty of the variation of the index.
    pub index_variation_penalty: IndexPenalty,
    /// Weight of the deviation of the index from 1.
    pub index_deviation: f32,
    /// Penalty of the deviation of the index from 1.
    pub index_deviation_penalty: IndexPenalty,
    /// Factor on `tv_density` once rays bend: what is seen through glass is seen from few sides.
    pub bent_tv: f32,
    /// Raw density inside the refractive shape when rays begin to bend.
    pub contents_density: f32,
    /// Whether surfaces mirror the share of the light that they do not let pass.
    pub reflection: Switch,
    /// How much that is.
    pub reflection_weight: ReflectionWeight,
    /// Where the mirrored light comes from.
    pub reflection_cache: ReflectionCache,
    /// Radiance probes along the longest edge of a refractive region.
    pub reflection_probes: u32,
    /// Degree of their spherical harmonics, 0 to 3.
    pub reflection_degree: u8,
    /// Steps between two looks of baked probes at the field.
    pub reflection_bake: u64,
    /// Learning rate of the coefficients of learned probes.
    pub rate_reflection: f32,
    /// Learning rate of how strongly a surface mirrors.
    pub rate_strength: f32,
    /// Whether opaque things have a clearcoat that mirrors.
    pub clearcoat: Switch,
    /// Index of refraction of the clearcoat.
    pub clearcoat_index: f32,
    /// Share of the run after which the clearcoat is there: surfaces must be known before they mirror.
    pub clearcoat_start: f64,
    /// Probes of the clearcoat along the longest edge of the scene.
    pub clearcoat_probes: u32,
    /// Learning rate of how strongly the clearcoat mirrors.
    pub rate_clearcoat: f32,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            seed: 0,
            steps: 12_000,
            stop_after: 0,
            minutes: 0.0,
            batch: 8192,
            sh_degree: 2,
            resolution: 0,
            voxels_per_pixel: 1.35,
            max_resolution: 256,
            stages: 3,
            stage_share: 0.15,
            train_step: 1.0,
            render_step: 0.5,
            near: 0.2,
            min_optical_depth: 1e-3,
            min_transmittance: 1e-3,
            rate_density: 1.0,
            rate_colour: 0.02,
            rate_background: 0.01,
            rate_decay: 0.05,
            warm_up: 0.01,
            view_warm_up: 1.0,
            initial_density: -5.0,
            sparsity: 0.0,
            opacity: 0.0,
            tv_density: 1e-5,
            tv_colour: 1e-5,
            tv_decay: 0.1,
            tv_period: 16,
            prune_weight: 0.005,
            environment_rows: 64,
            memory: 8.0,
            refraction: Bending::Off,
            refraction_box: String::new(),
            straight_steps: 300,
            index_share: 0.02,
            inside_share: 0.4,
            inside_share_decay: 0.5,
            index_shape: IndexShape::Hull,
            index_surface: Surface::Auto,
            index_from: String::new(),
            index_scan: Switch::On,
            index_guess: 1.4,
            index_vote: 0.95,
            index_faces: Switch::On,
            index_smooth: 0.7,
            index_resolution: 0,
            index_voxels_per_pixel: 0.7,
            index_interpolation: IndexInterpolation::Cubic,
            index_stepping: Stepping::Leapfrog,
            index_step: 0.5,
            index_gate: Switch::On,
            index_interior: Switch::On,
            rate_index: 0.001,
            surface_coarsening: 1.4,
            rate_surface: 0.08,
            surface_blur: 1.5,
            surface_smooth: 0.1,
            surface_events: 2,
            index_blur: 1.5,
            index_clip: 3.0,
            index_largest: 2.6,
            index_trust: 0.06,
            index_variation: 0.0,
            index_variation_penalty: IndexPenalty::L1,
            index_deviation: 0.0,
            index_deviation_penalty: IndexPenalty::L1,
            bent_tv: 5.0,
            contents_density: -5.0,
            reflection: Switch::On,
            reflection_weight: ReflectionWeight::Whole,
            reflection_cache: ReflectionCache::Learned,
            reflection_probes: 8,
            reflection_degree: 3,
            reflection_bake: 250,
            rate_reflection: 0.01,
            rate_strength: 0.003,
            clearcoat: Switch::Off,
            clearcoat_index: 1.5,
            clearcoat_start: 0.15,
            clearcoat_probes: 16,
            rate_clearcoat: 0.02,
        }
    }
}

/// Why a configuration was refused.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum ConfigError {
    /// A key that does not exist.
    #[error("unknown option `{key}`; known options are: {known}")]
    Unknown {
        /// The key.
        key: String,
        /// All keys there are.
        known: String,
    },
    /// A value of the wrong type.
    #[error("option `{key}` is `{found}`, expected a {expected}")]
    Type {
        /// The key.
        key: String,
        /// The value.
        found: String,
        /// "number" or "whole number".
        expected: &'static str,
    },
    /// A word that is not one of the choices.
    #[error("option `{key}`: {problem}")]
    Choice {
        /// The key.
        key: String,
        /// What is wrong, and what is possible.
        problem: String,
    },
    /// A value out of range.
    #[error("option `{key}` is {found}, expected {expected}")]
    Range {
        /// The key.
        key: &'static str,
        /// The value.
        found: String,
        /// The range.
        expected: &'static str,
    },
}

impl Config {
    /// Defaults for a kind of scene. Photographs of open surroundings are fewer and cover everything more thinly than
    /// pictures of an object before a plain background: they want slower density and more smoothness.
    pub fn suited_to(unbounded: bool) -> Self {
        if !unbounded {
            return Self::default();
        }
        Self {
            rate_density: 0.3,
            tv_density: 1e-4,
            tv_colour: 1e-4,
            voxels_per_pixel: 1.0,
            ..Self::default()
        }
    }

    /// Change options from (key, value) pairs in order; later ones win.
    pub fn with<'a>(
        self,
        settings: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ConfigError> {
        let mut all = self.to_map();
        for (key, text) in settings {
            let Some(old) = all.get(key) else {
                let known = all.keys().cloned().collect::<Vec<_>>().join(", ");
                return Err(ConfigError::Unknown { key: key.to_owned(), known });
            };
            let value = parse(key, text, old)?;
            all.insert(key.to_owned(), value);
            serde_json::from_value::<Self>(Value::Object(all.clone()))
                .map_err(|e| ConfigError::Choice { key: key.to_owned(), problem: e.to_string() })?;
        }
        let config: Option<Self> = serde_json::from_value(Value::Object(all)).ok();
        config.unwrap_or(self).checked()
    }

    fn to_map(&self) -> Map<String, Value> {
        match serde_json::to_value(self) {
            Ok(Value::Object(map)) => map,
            _ => Map::new(),
        }
    }

    /// The same configuration if every value makes sense.
    pub fn checked(self) -> Result<Self, ConfigError> {
        let range = |ok: bool, key, found: String, expected| {
            if ok { Ok(()) } else { Err(ConfigError::Range { key, found, expected }) }
        };
        let real = |key, v: f32, low: f32, high: f32, expected| {
            range(v >= low && v <= high, key, v.to_string(), expected)
        };
        range(self.steps > 0, "steps", self.steps.to_string(), "at least 1")?;
        range((1..=1 << 20).contains(&self.batch), "batch", self.batch.to_string(), "1 to 1048576 rays")?;
        range(self.sh_degree <= 3, "sh_degree", self.sh_degree.to_string(), "0, 1, 2 or 3")?;
        let resolution = |n: u32| n == 0 || (8..=1024).contains(&n);
        range(
            resolution(self.resolution),
            "resolution",
            self.resolution.to_string(),
            "0 (automatic) or 8 to 1024",
        )?;
        range(
            (16..=1024).contains(&self.max_resolution),
            "max_resolution",
            self.max_resolution.to_string(),
            "16 to 1024",
        )?;
        range((1..=6).contains(&self.stages), "stages", self.stages.to_string(), "1 to 6")?;
        range(
            self.stage_share > 0.0 && self.stage_share < 1.0,
            "stage_share",
            self.stage_share.to_string(),
            "between 0 and 1",
        )?;
        range(
            self.minutes >= 0.0 && self.minutes.is_finite(),
            "minutes",
            self.minutes.to_string(),
            "0 or more",
        )?;
        range(self.memory > 0.0, "memory", self.memory.to_string(), "more than 0 GiB")?;
        range(
            (1..=1 << 20).contains(&self.tv_period),
            "tv_period",
            self.tv_period.to_string(),
            "at least 1",
        )?;
        range(
            (1..=2048).contains(&self.environment_rows),
            "environment_rows",
            self.environment_rows.to_string(),
            "1 to 2048",
        )?;
        let ratio = self.voxels_per_pixel;
        range((0.1..=8.0).contains(&ratio), "voxels_per_pixel", ratio.to_string(), "0.1 to 8")?;
        real("train_step", self.train_step, 0.05, 4.0, "0.05 to 4 voxels")?;
        real("render_step", self.render_step, 0.05, 4.0, "0.05 to 4 voxels")?;
        real("near", self.near, 0.0, 0.99, "0 to 0.99")?;
        real("min_optical_depth", self.min_optical_depth, 0.0, 0.1, "0 to 0.1")?;
        real("min_transmittance", self.min_transmittance, 0.0, 0.5, "0 to 0.5")?;
        for (key, v) in [
            ("rate_density", self.rate_density),
            ("rate_colour", self.rate_colour),
            ("rate_background", self.rate_background),
        ] {
            real(key, v, 0.0, 100.0, "0 to 100")?;
        }
        real("rate_decay", self.rate_decay, 1e-6, 1.0, "1e-6 to 1")?;
        real("warm_up", self.warm_up, 0.0, 1.0, "0 to 1")?;
        real("view_warm_up", self.view_warm_up, 0.0, 1.0, "0 to 1")?;
        real("initial_density", self.initial_density, -9.0, 9.0, "-9 to 9")?;
        for (key, v) in [
            ("sparsity", self.sparsity),
            ("opacity", self.opacity),
            ("tv_density", self.tv_density),
            ("tv_colour", self.tv_colour),
            ("prune_weight", self.prune_weight),
        ] {
            real(key, v, 0.0, 1e6, "0 or more")?;
        }
        real("tv_decay", self.tv_decay, 1e-6, 1.0, "1e-6 to 1")?;
        self.checked_refraction(&range)?;
        Ok(self)
    }
}

impl Config {
    fn checked_refraction(
        &self,
        range: &impl Fn(bool, &'static str, String, &'static str) -> Result<(), ConfigError>,
    ) -> Result<(), ConfigError> {
        let within = |key, v: f64, low: f64, high: f64, expected| {
            range((low..=high).contains(&v), key, v.to_string(), expected)
        };
        within("index_share", self.index_share, 0.0, 0.7, "0 to 0.7")?;
        within("inside_share", self.inside_share, 0.0, 1.0, "0 to 1")?;
        within("inside_share_decay", self.inside_share_decay, 0.0, 1.0, "0 to 1")?;
        within("index_guess", self.index_guess.into(), 1.0, 4.0, "1 to 4")?;
        within("index_largest", self.index_largest.into(), 1.0, 5.0, "1 to 5")?;
        within("index_vote", self.index_vote.into(), 0.5, 1.0, "0.5 to 1")?;
        within("index_smooth", self.index_smooth.into(), 0.0, 8.0, "0 to 8 voxels")?;
        within("index_blur", self.index_blur.into(), 0.0, 8.0, "0 to 8 voxels")?;
        within("index_step", self.index_step.into(), 0.05, 1.0, "0.05 to 1 voxel")?;
        within("index_voxels_per_pixel", self.index_voxels_per_pixel, 0.05, 4.0, "0.05 to 4")?;
        within("index_trust", self.index_trust.into(), 0.0, 4.0, "0 to 4")?;
        within("rate_index", self.rate_index.into(), 0.0, 1.0, "0 to 1")?;
        within("surface_coarsening", self.surface_coarsening.into(), 1.0, 1.5, "1 to 1.5")?;
        within("rate_surface", self.rate_surface.into(), 0.0, 1.0, "0 to 1 voxel")?;
        within("surface_blur", self.surface_blur.into(), 0.0, 8.0, "0 to 8 voxels")?;
        within("surface_smooth", self.surface_smooth.into(), 0.0, 1.0, "0 to 1")?;
        within("bent_tv", self.bent_tv.into(), 0.0, 1e3, "0 to 1000")?;
        within("contents_density", self.contents_density.into(), -12.0, 9.0, "-12 to 9")?;
        for (key, v) in [
            ("index_clip", self.index_clip),
            ("index_variation", self.index_variation),
            ("index_deviation", self.index_deviation),
        ] {
            within(key, v.into(), 0.0, 1e6, "0 or more")?;
        }
        self.checked_reflection(range)?;
        let n = self.index_resolution;
        range(
            n == 0 || (16..=512).contains(&n),
            "index_resolution",
            n.to_string(),
            "0 (automatic) or 16 to 512",
        )?;
        range(
            self.bounds_of_box().is_some() || self.refraction_box.is_empty(),
            "refraction_box",
            self.refraction_box.clone(),
            "x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1, z0 < z1",
        )?;
        range(
            self.index_shape != IndexShape::File || !self.index_from.is_empty(),
            "index_shape",
            "file".to_owned(),
            "index_from to name the file",
        )
    }

    fn checked_reflection(
        &self,
        range: &impl Fn(bool, &'static str, String, &'static str) -> Result<(), ConfigError>,
    ) -> Result<(), ConfigError> {
        let (probes, degree) = (self.reflection_probes, self.reflection_degree);
        range((2..=64).contains(&probes), "reflection_probes", probes.to_string(), "2 to 64")?;
        range(degree <= 3, "reflection_degree", degree.to_string(), "0, 1, 2 or 3")?;
        let probes = self.clearcoat_probes;
        range((2..=64).contains(&probes), "clearcoat_probes", probes.to_string(), "2 to 64")?;
        let (index, start) = (self.clearcoat_index, self.clearcoat_start);
        range((1.0..=4.0).contains(&index), "clearcoat_index", index.to_string(), "1 to 4")?;
        range((0.0..=1.0).contains(&start), "clearcoat_start", start.to_string(), "0 to 1")?;
        let bake = self.reflection_bake;
        range(bake > 0, "reflection_bake", bake.to_string(), "at least 1 step")?;
        for (key, rate) in [
            ("rate_reflection", self.rate_reflection),
            ("rate_strength", self.rate_strength),
            ("rate_clearcoat", self.rate_clearcoat),
        ] {
            range((0.0..=1.0).contains(&rate), key, rate.to_string(), "0 to 1")?;
        }
        Ok(())
    }

    /// The box of `refraction_box`.
    pub fn bounds_of_box(&self) -> Option<Aabb<f32>> {
        let v: Vec<f32> =
            self.refraction_box.split(',').map(|v| v.trim().parse().ok()).collect::<Option<_>>()?;
        let &[x0, y0, z0, x1, y1, z1] = v.as_slice() else { return None };
        let valid = x0 < x1 && y0 < y1 && z0 < z1 && v.iter().all(|v| v.is_finite());
        valid.then(|| Aabb::new(vec3(x0, y0, z0), vec3(x1, y1, z1)))
    }
}

/// A value of the type that the option has.
fn parse(key: &str, text: &str, old: &Value) -> Result<Value, ConfigError> {
    if old.is_string() {
        return Ok(Value::from(text));
    }
    let whole = !old.is_f64();
    let value = if whole {
        text.parse::<u64>().ok().map(Value::from)
    } else {
        text.parse::<f64>().ok().filter(|v| v.is_finite()).map(Value::from)
    };
    let expected = if whole { "whole number" } else { "number" };
    value.ok_or_else(|| ConfigError::Type { key: key.to_owned(), found: text.to_owned(), expected })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_change_options_in_order() {
        let c = Config::default().with([("steps", "7"), ("rate_density", "0.5"), ("steps", "9")]).unwrap();
        assert_eq!((c.steps, c.rate_density), (9, 0.5));
    }

    fn text(v: &Value) -> String {
        v.as_str().map_or_else(|| v.to_string(), str::to_owned)
    }

    #[test]
    fn every_default_survives_a_round_trip() {
        let all: Vec<(String, String)> =
            Config::default().to_map().into_iter().map(|(k, v)| (k, text(&v))).collect();
        let c = Config::default().with(all.iter().map(|(k, v)| (k.as_str(), v.as_str()))).unwrap();
        assert_eq!(c, Config::default());
    }

    #[test]
    fn mistakes_are_named() {
        let refuse = |k, v| Config::default().with([(k, v)]).unwrap_err().to_string();
        assert!(refuse("stepz", "7").starts_with("unknown option `stepz`; known options are: batch,"));
        assert_eq!(refuse("steps", "7.5"), "option `steps` is `7.5`, expected a whole number");
        assert_eq!(refuse("sh_degree", "4"), "option `sh_degree` is 4, expected 0, 1, 2 or 3");
        assert_eq!(refuse("rate_density", "NaN"), "option `rate_density` is `NaN`, expected a number");
        assert!(refuse("train_step", "0").contains("0.05 to 4 voxels"));
        let choice = refuse("index_shape", "cube");
        assert!(choice.contains("option `index_shape`") && choice.contains("`hull`"), "{choice}");
        assert!(refuse("refraction_box", "0,0,0,1,1").contains("x0,y0,z0"));
    }
}
