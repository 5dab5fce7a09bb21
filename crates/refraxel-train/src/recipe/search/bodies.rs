//! Bodies of candidates: shapes take longer to make than a few thousand rays take to judge them, and most candidates differ
//! from one before in the index alone.

use crate::cancel::{Cancel, Cancelled};
use crate::options::Options;
use crate::recipe::hypotheses::{Body, Candidate};
use crate::recipe::region::Region;
use crate::verdict::Hypothesis;
use rayon::prelude::*;

/// Shapes that are kept.
const KEPT: usize = 32;

/// What a shape depends on: the hypothesis, the nodes of its grid, and all numbers but the index.
#[derive(Clone, PartialEq)]
struct Key {
    kind: Hypothesis,
    region: usize,
    resolution: [u32; 3],
    numbers: Vec<f32>,
}

impl Key {
    /// Nothing where the index belongs to the shape.
    fn of(candidate: &Candidate, region: usize, place: &Region) -> Option<Self> {
        let Candidate { proposal, values, .. } = candidate;
        let numbers = values.get(1..).unwrap_or_default().to_vec();
        let resolution = place.site.resolution;
        proposal.is_sharp.then_some(Self { kind: proposal.kind, region, resolution, numbers })
    }
}

/// The last shapes that were made, the oldest first.
#[derive(Default)]
pub(super) struct Shapes {
    made: Vec<(Key, Vec<Body>)>,
}

impl Shapes {
    /// Makes the shapes of these candidates for a region on all threads, unless somebody wishes to stop; `place` is the region or
    /// its sketch.
    pub(super) fn make(
        &mut self,
        candidates: &[&Candidate],
        region: usize,
        place: &Region,
        (options, cancel): (&Options, &Cancel),
    ) -> Result<(), Cancelled> {
        let mut wanted: Vec<(Key, &Candidate)> = Vec::new();
        for &candidate in candidates {
            let key = Key::of(candidate, region, place).filter(|key| self.find(key).is_none());
            if let Some(key) = key.filter(|key| wanted.iter().all(|(k, _)| k != key)) {
                wanted.push((key, candidate));
            }
        }
        wanted.truncate(KEPT);
        let of = |(key, candidate): (Key, &Candidate)| {
            cancel.check()?;
            Ok((key, candidate.bodies(place, options)))
        };
        let made: Vec<_> = wanted.into_par_iter().map(of).collect::<Result<_, Cancelled>>()?;
        self.made.extend(made);
        self.made.drain(..self.made.len().saturating_sub(KEPT));
        Ok(())
    }

    /// The bodies of a candidate.
    pub(super) fn bodies(
        &self,
        candidate: &Candidate,
        region: usize,
        place: &Region,
        options: &Options,
    ) -> Vec<Body> {
        let known = Key::of(candidate, region, place).and_then(|key| self.find(&key));
        known.map_or_else(|| candidate.bodies(place, options), |shape| candidate.bodies_of_shape(shape))
    }

    fn find(&self, key: &Key) -> Option<&[Body]> {
        self.made.iter().find(|(k, _)| k == key).map(|(_, bodies)| &bodies[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::initial::Site;
    use crate::recipe::hypotheses::proposals;
    use refraxel_core::{Aabb, Vec3};

    #[test]
    fn a_kept_shape_is_the_body_that_its_candidate_makes() {
        let options = Options::default();
        let bounds = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let site = Site { bounds, resolution: [33; 3], interpolation: options.index.interpolation.into() };
        let region = Region::body(site, |x| x.length() - 0.6, &options);
        for proposal in proposals(&region, &options) {
            let unknowns = (proposal.unknowns)(&region);
            let numbers = |index: f32| {
                let others = unknowns[1..].iter().map(|u| u.first[u.first.len() / 2]);
                std::iter::once(index).chain(others).collect()
            };
            let candidate = |index| Candidate {
                proposal,
                values: numbers(index),
                searched: true,
                tint: [0.1, 0.0, 0.2],
                refined: None,
            };
            let mut shapes = Shapes::default();
            let cancel = Cancel::new();
            shapes.make(&[&candidate(1.3)], 0, &region, (&options, &cancel)).unwrap();
            cancel.cancel();
            let stopped = Shapes::default().make(&[&candidate(1.3)], 0, &region, (&options, &cancel));
            assert_eq!(stopped.is_err(), proposal.is_sharp, "a wish to stop is seen before a shape is made");
            assert_eq!(shapes.made.len(), usize::from(proposal.is_sharp), "{:?}", proposal.kind);
            let found = shapes.bodies(&candidate(1.7), 0, &region, &options);
            let made = candidate(1.7).bodies(&region, &options);
            assert!(!made.is_empty());
            let of = |b: &Body| {
                let grid = &b.grid;
                let field = (grid.coefficients().to_vec(), grid.level_set().cloned(), grid.absorption());
                (field, b.state.clone())
            };
            assert!(found.iter().map(of).eq(made.iter().map(of)), "{:?}", proposal.kind);
        }
    }
}
