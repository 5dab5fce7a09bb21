//! The same shapes with another index of refraction: what a reconstruction would look like in water or in diamond.

use super::Refraction;
use refraxel_core::IndexGrid;

/// How the index of all regions is changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IndexEdit {
    /// n − 1, the contrast to vacuum that bends rays, is multiplied by this: 0 for straight rays.
    Scale(f32),
    /// Each region gets this index: all of a body of one index; other fields keep their shape, their n − 1 multiplied
    /// so that this becomes their [`typical_index`]. Bubbles, bodies of n = 1 that overlap others, stay as they are.
    Set(f32),
}

/// Why an index cannot be changed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum IndexEditError {
    /// There is nothing to change.
    #[error("its rays are straight: there is no index of refraction to change")]
    Straight,
    /// A field of n = 1 has no shape.
    #[error("refractive region {region} is as thin as vacuum, so that no factor gives it another index")]
    Vacuum {
        /// Number of the region, from 1.
        region: usize,
    },
    /// Beyond all matter.
    #[error("n would reach {found:.2} in refractive region {region}; expected {} to {}", RANGE[0], RANGE[1])]
    Range {
        /// Number of the region, from 1.
        region: usize,
        /// The index.
        found: f32,
    },
}

/// Indices that an edit may lead to.
pub const RANGE: [f32; 2] = [0.25, 4.0];
/// Contrasts |n − 1| below this cannot be scaled to another one: they are rounding.
const LEAST_CONTRAST: f32 = 1e-4;

/// n at the nodes of a region: of a body with a surface, at those inside.
fn indices(grid: &IndexGrid<f32>) -> impl Iterator<Item = f32> {
    let inside = |j: usize| grid.level_set().is_none_or(|l| l.is_inside(grid.position(j)));
    let nodes = grid.coefficients().iter().enumerate().filter(move |&(j, _)| inside(j));
    let body = grid.level_set().and(grid.interior_index());
    body.into_iter()
        .chain(nodes.take(if body.is_some() { 0 } else { usize::MAX }).map(|(_, &c)| (2.0 * c).sqrt()))
}

/// The median of n, weighted by (n − 1)²: the index of a homogeneous body, also with a soft edge, and that of the denser
/// parts of a graded one; `None` where all is vacuum. For a ball of n = 1.5 whose edge is a tanh of 8 % of its radius it
/// is 1.498, of 14 % 1.487.
pub fn typical_index(grid: &IndexGrid<f32>) -> Option<f32> {
    let weight = |n: f32| f64::from(n - 1.0).powi(2);
    let mut sorted: Vec<f32> = indices(grid).filter(|n| (n - 1.0).abs() > LEAST_CONTRAST).collect();
    sorted.sort_by(f32::total_cmp);
    let half = 0.5 * sorted.iter().map(|&n| weight(n)).sum::<f64>();
    let mut below = 0.0;
    sorted.into_iter().find(|&n| {
        below += weight(n);
        below >= half
    })
}

/// Half-way in n between vacuum and [`typical_index`]: where a soft edge is.
pub fn half_way_index(grid: &IndexGrid<f32>) -> Option<f32> {
    typical_index(grid).map(|n| 0.5 * (1.0 + n))
}

/// Smallest and largest n of all regions and of the vacuum around them.
pub fn index_range(refraction: &Refraction) -> [f32; 2] {
    let all = refraction.medium.regions().iter().flat_map(indices);
    all.fold([1.0, 1.0], |[low, high]: [f32; 2], n| [low.min(n), high.max(n)])
}

impl IndexEdit {
    /// Changes the index of all regions, or none. An edit to the index that is there already leaves it bit by bit.
    pub fn apply(self, refraction: &mut Refraction) -> Result<(), IndexEditError> {
        if refraction.is_none() {
            return Err(IndexEditError::Straight);
        }
        let mut edited = refraction.clone();
        for k in 0..edited.medium.regions().len() {
            self.apply_in_place(k, &mut edited)?;
        }
        edited.find_flat_cells();
        *refraction = edited;
        Ok(())
    }

    /// Changes the index of one region, counted from 0, or nothing.
    ///
    /// # Panics
    /// If there is no such region.
    pub fn apply_to(self, region: usize, refraction: &mut Refraction) -> Result<(), IndexEditError> {
        let mut edited = refraction.clone();
        self.apply_in_place(region, &mut edited)?;
        edited.find_flat_cells();
        *refraction = edited;
        Ok(())
    }

    /// Changes one region, whose flat cells are to be found again.
    fn apply_in_place(self, k: usize, edited: &mut Refraction) -> Result<(), IndexEditError> {
        let region = k + 1;
        let is_nested = !edited.medium.neighbours(k).is_empty();
        let grid = edited.medium.region_mut(k);
        match self {
            Self::Set(_) if is_nested && typical_index(grid).is_none() => {}
            Self::Set(n) if grid.level_set().is_some() && grid.interior_index().is_some() => {
                grid.set_interior_index(n);
            }
            Self::Set(n) => {
                let typical = typical_index(grid).ok_or(IndexEditError::Vacuum { region })?;
                scale(grid, (n - 1.0) / (typical - 1.0));
            }
            Self::Scale(factor) => scale(grid, factor),
        }
        match indices(grid).find(|n| !(RANGE[0]..=RANGE[1]).contains(n)) {
            Some(found) => Err(IndexEditError::Range { region, found }),
            None => Ok(()),
        }
    }
}

/// n − 1 times `factor`, coefficient by coefficient: exact where the field is flat; within a transition it differs from
/// the scaled field by the curvature of n²/2, a few percent of the change.
fn scale(grid: &mut IndexGrid<f32>, factor: f32) {
    if factor == 1.0 {
        return;
    }
    for c in grid.coefficients_mut() {
        let n = 1.0 + factor * ((*c + *c).sqrt() - 1.0);
        *c = 0.5 * n * n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, Interpolation, LevelSet, Vec3};

    fn smooth() -> Refraction {
        let n = |x: Vec3<f32>| 1.25 - 0.25 * ((x.length() - 0.6) * 24.0).tanh();
        Refraction::of(vec![IndexGrid::from_control_values(
            Aabb::cube(1.0),
            [33; 3],
            Interpolation::CubicBSpline,
            n,
        )])
    }

    fn sharp() -> Refraction {
        let ball = LevelSet::from_samples(Aabb::cube(1.0), [21; 3], |x: Vec3<f32>| x.length() - 0.6);
        Refraction::of(vec![IndexGrid::sharp(ball, 1.5)])
    }

    fn at_the_middle(r: &Refraction) -> f32 {
        r.index(Vec3::zero())
    }

    #[test]
    fn the_index_that_is_there_changes_nothing() {
        for r in [smooth(), sharp()] {
            let typical = typical_index(&r.medium.regions()[0]).unwrap();
            assert!((typical - 1.5).abs() < 3e-3, "{typical}");
            for edit in [IndexEdit::Set(typical), IndexEdit::Scale(1.0)] {
                let mut edited = r.clone();
                edit.apply(&mut edited).unwrap();
                let coefficients = |r: &Refraction| r.medium.regions()[0].coefficients().to_vec();
                assert_eq!(coefficients(&edited), coefficients(&r), "{edit:?}");
            }
        }
    }

    #[test]
    fn contrast_is_scaled_and_vacuum_stays() {
        for r in [smooth(), sharp()] {
            for (edit, expected) in [
                (IndexEdit::Set(1.33), 1.33),
                (IndexEdit::Set(0.8), 0.8),
                (IndexEdit::Scale(0.5), 1.25),
                (IndexEdit::Scale(0.0), 1.0),
            ] {
                let mut edited = r.clone();
                edit.apply(&mut edited).unwrap();
                // The middle of a soft ball is a little denser than what is typical of it.
                assert!((at_the_middle(&edited) - expected).abs() < 3e-3, "{edit:?}");
                assert_eq!(edited.index(Vec3::splat(0.9)), 1.0, "{edit:?}");
                let [low, high] = index_range(&edited);
                assert!(low >= expected.min(1.0) - 3e-3 && high <= expected.max(1.0) + 3e-3, "{low} {high}");
            }
        }
    }

    #[test]
    fn impossible_edits_leave_everything_as_it_was() {
        assert_eq!(IndexEdit::Set(1.5).apply(&mut Refraction::none()), Err(IndexEditError::Straight));
        let mut far = smooth();
        let error = IndexEdit::Scale(9.0).apply(&mut far).unwrap_err();
        assert!(matches!(error, IndexEditError::Range { region: 1, .. }), "{error}");
        assert!((at_the_middle(&far) - 1.5).abs() < 1e-3);
        let mut vacuum =
            Refraction::of(vec![IndexGrid::vacuum(Aabb::cube(1.0), [9; 3], Interpolation::CubicBSpline)]);
        let error = IndexEdit::Set(1.5).apply(&mut vacuum).unwrap_err();
        assert_eq!(error, IndexEditError::Vacuum { region: 1 });
    }
}
