//! What the surfaces of a model mirror: how strongly, and from where, theory (7.5)–(7.10).

use super::Refraction;
use refraxel_core::Aabb;
use refraxel_core::optics::PartialReflection;
use refraxel_core::radiance::ProbeGrid;
use refraxel_core::sh::ShDegree;
use serde::{Deserialize, Serialize};

/// The reflective part of a model. Without mirrors nothing is reflected but totally.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reflection {
    /// Where the mirrored light comes from.
    pub source: MirrorSource,
    /// One per refractive region.
    pub mirrors: Vec<Mirror>,
}

/// Where mirrored light comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MirrorSource {
    /// Probes that begin with what the field shows them, and learn from the pictures.
    #[default]
    Learned,
    /// A second ray through the field. Slow: it judges the probes. The field does not learn from it.
    Exact,
    /// Nothing: surfaces mirror blackness. For pictures of what is transmitted alone.
    Black,
}

impl MirrorSource {
    /// True where radiance caches say what is mirrored.
    #[inline(always)]
    pub fn reads_caches(self) -> bool {
        self == Self::Learned
    }
}

/// The surface of one region.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    /// Share ρ ∈ [0, 1] of Fresnel's reflectance that is really seen: 0 where pictures show no reflections.
    pub strength: f32,
    /// What its surface mirrors to rays in vacuum: the surroundings.
    pub outer: ProbeGrid<f32>,
    /// What surfaces mirror to rays inside the body: its own from behind, and those of bodies in it.
    pub inner: ProbeGrid<f32>,
}

/// One of the caches of a [`Reflection`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheId {
    /// Number of the region that it belongs to.
    pub region: u16,
    /// The inner cache, else the outer one.
    pub inner: bool,
}

impl CacheId {
    /// The cache that a partial reflection reads: the inner one of the region in which the reflected light arrives, or in
    /// vacuum the outer one of the body whose surface reflects.
    #[inline(always)]
    pub fn read_by(of: &PartialReflection<f32>) -> Self {
        Self { region: of.within.unwrap_or(of.region), inner: of.within.is_some() }
    }
}

/// Size of the caches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeLayout {
    /// Probes along the longest edge of a region, at least 2.
    pub longest: u32,
    /// Degree of their harmonics.
    pub degree: ShDegree,
}

/// Degree of the harmonics of what surfaces and clearcoats mirror.
pub const PROBE_DEGREE: ShDegree = ShDegree::MAX;

impl ProbeLayout {
    /// Grey probes over a box.
    pub fn probes(&self, bounds: Aabb<f32>) -> ProbeGrid<f32> {
        let spacing = bounds.extent().max_element() / (self.longest.max(2) - 1) as f32;
        // A little more, lest rounding adds a row.
        ProbeGrid::spaced(bounds, spacing * 1.0001, self.degree)
    }
}

impl Reflection {
    /// Nothing is mirrored but totally.
    pub fn none() -> Self {
        Self::default()
    }

    /// True when nothing is mirrored but totally.
    pub fn is_none(&self) -> bool {
        self.mirrors.is_empty()
    }

    /// Mirrors of full strength, whose probes are still grey, for all regions.
    pub fn of(refraction: &Refraction, source: MirrorSource, layout: &ProbeLayout) -> Self {
        let mirror = |bounds: Aabb<f32>| {
            let probes = layout.probes(bounds);
            Mirror { strength: 1.0, outer: probes.clone(), inner: probes }
        };
        let regions = refraction.medium.regions().iter();
        Self { source, mirrors: regions.map(|r| mirror(r.domain().bounds)).collect() }
    }

    /// One of the caches.
    ///
    /// # Panics
    /// If there is no region of this number.
    #[inline(always)]
    pub fn cache(&self, id: CacheId) -> &ProbeGrid<f32> {
        self.mirrors[usize::from(id.region)].cache(id.inner)
    }

    /// The same, seen without what is mirrored: as if no surface reflected.
    #[must_use]
    pub fn without_strength(&self) -> Self {
        let mut silent = self.clone();
        silent.mirrors.iter_mut().for_each(|m| m.strength = 0.0);
        silent
    }
}

impl Mirror {
    /// The cache of one side.
    #[inline(always)]
    pub fn cache(&self, inner: bool) -> &ProbeGrid<f32> {
        if inner { &self.inner } else { &self.outer }
    }
}
