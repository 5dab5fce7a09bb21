//! Where a grid lies, in the numbers that shaders know of it.

use super::domain::{CONTRACTED_FAR, Domain, Extent};
use super::projection::PROJECTED_FAR;
use crate::{Vec3, vec3};

/// What `Scene` of `scene.wgsl` holds of a domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Middle of the box; the eye of a projective grid.
    pub center: Vec3<f32>,
    /// Largest normalised coordinate.
    pub reach: f32,
    /// Normalised coordinates per scene unit; of a projective grid, one over half the widths of x/z and y/z, and twice the nearest
    /// depth.
    pub unit_per_world: Vec3<f32>,
    /// The box that clips rays; of a projective grid, the lowest and highest x/z, y/z and z.
    pub lowest: Vec3<f32>,
    /// See `lowest`.
    pub highest: Vec3<f32>,
    /// 0 of a bounded, 1 of a contracted, 2 of a projective grid.
    pub extent: u32,
    /// Right, down and ahead of a projective grid.
    pub axes: [Vec3<f32>; 3],
}

impl Domain<f32> {
    /// Where the grid lies.
    pub fn placement(&self) -> Placement {
        let (center, half) = (self.bounds.center(), self.bounds.extent() * 0.5);
        let boxed = |reach, far: f32, extent| Placement {
            center,
            reach,
            unit_per_world: self.unit_per_world(),
            lowest: if extent == 0 { self.bounds.min } else { center - half * far },
            highest: if extent == 0 { self.bounds.max } else { center + half * far },
            extent,
            axes: [Vec3::zero(); 3],
        };
        match &self.extent {
            Extent::Bounded => boxed(1.0, 1.0, 0),
            Extent::Contracted => boxed(2.0, CONTRACTED_FAR as f32, 1),
            Extent::Projective(p) => {
                let [[left, right], [top, bottom]] = p.edges;
                Placement {
                    center: p.eye,
                    reach: 1.0,
                    unit_per_world: vec3(2.0 / (right - left), 2.0 / (bottom - top), 2.0 * p.near),
                    lowest: vec3(left, top, p.near),
                    highest: vec3(right, bottom, p.near * PROJECTED_FAR),
                    extent: 2,
                    axes: p.axes,
                }
            }
        }
    }
}
