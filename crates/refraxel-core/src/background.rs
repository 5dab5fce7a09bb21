//! The background: the radiance that an exit ray meets, theory (3.15).

use crate::{Real, Vec3, vec3};

/// Radiance arriving from beyond the field along any exit ray.
#[derive(Clone, Debug, PartialEq)]
pub enum Background<T> {
    /// The same colour in all directions (sRGB-encoded, 1 = white).
    Constant([T; 3]),
    /// A panorama at infinity.
    Environment(EnvironmentMap<T>),
}

/// An equirectangular panorama at infinity, theory (3.15): `height` rows from +z to −z, `width = 2 height` columns of
/// azimuth atan2(y, x) ∈ [−π, π), bilinear, periodic in azimuth.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap<T> {
    height: usize,
    /// `height × width` colours (sRGB-encoded, 1 = white), columns fastest.
    pub texels: Vec<[T; 3]>,
}

/// Least x² + y² of a unit direction in the derivative by its azimuth [1], which a pole does not have.
pub const POLE: f64 = 1e-12;

/// The four texels around a direction and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelWeights<T> {
    /// Indices into [`EnvironmentMap::texels`]: left and right of the upper row, then of the lower one.
    pub index: [usize; 4],
    /// ≥ 0, summing to 1.
    pub weight: [T; 4],
}

impl<T: Real> EnvironmentMap<T> {
    /// A uniform panorama of `height` × 2 `height` texels.
    ///
    /// # Panics
    /// If `height` is 0.
    pub fn uniform(height: usize, colour: [T; 3]) -> Self {
        assert!(height > 0, "an environment map needs at least one row");
        Self { height, texels: vec![colour; 2 * height * height] }
    }

    /// The panorama with these texels; `None` unless there are 2 `height`² of them.
    pub fn from_texels(height: usize, texels: Vec<[T; 3]>) -> Option<Self> {
        (height > 0 && texels.len() == 2 * height * height).then_some(Self { height, texels })
    }

    /// Number of rows; there are twice as many columns.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Fractional texel coordinates (column, row) of a unit direction, and their Jacobian rows d(column)/d(dir),
    /// d(row)/d(dir).
    fn coordinates(&self, d: Vec3<T>) -> ([T; 2], [Vec3<T>; 2]) {
        let (w, h) = (T::of(2.0 * self.height as f64), T::of(self.height as f64));
        let (pi, half) = (T::of(std::f64::consts::PI), T::of(0.5));
        let flat2 = (d.x * d.x + d.y * d.y).max(T::of(POLE));
        let flat = flat2.sqrt();
        let column = (d.y.atan2(d.x) / (pi + pi) + half) * w - half;
        let row = (flat.atan2(d.z) / pi) * h - half;
        let d_column = vec3(-d.y, d.x, T::zero()) * (w / ((pi + pi) * flat2));
        // row angle = atan2(flat, z), |d| = 1.
        let d_row = vec3(d.x * d.z / flat, d.y * d.z / flat, -flat) * (h / pi);
        ([column, row], [d_column, d_row])
    }

    /// Texels and bilinear weights for a unit direction, theory (3.15). The weights are also the derivative of
    /// [`Self::radiance`] by the texels.
    pub fn stencil(&self, d: Vec3<T>) -> TexelWeights<T> {
        let ([column, row], _) = self.coordinates(d);
        let (index, [fx, fy]) = self.cell(column, row);
        let (gx, gy) = (T::one() - fx, T::one() - fy);
        TexelWeights { index, weight: [gx * gy, fx * gy, gx * fy, fx * fy] }
    }

    /// The four texels around fractional texel coordinates, and the position between them in [0, 1)². Azimuth wraps round;
    /// beyond the first and last row the row repeats.
    fn cell(&self, column: T, row: T) -> ([usize; 4], [T; 2]) {
        let (w, h) = (2 * self.height as i64, self.height as i64);
        let (c0, r0) = (column.floor(), row.floor());
        let wrap = |c: i64| c.rem_euclid(w) as usize;
        let clamp = |r: i64| r.clamp(0, h - 1) as usize;
        let (c, r) = (c0.f64() as i64, r0.f64() as i64);
        let at = |c: usize, r: usize| r * w as usize + c;
        let index = [
            at(wrap(c), clamp(r)),
            at(wrap(c + 1), clamp(r)),
            at(wrap(c), clamp(r + 1)),
            at(wrap(c + 1), clamp(r + 1)),
        ];
        (index, [column - c0, row - r0])
    }

    /// Radiance from a unit direction (sRGB-encoded, 1 = white), bilinear between texels.
    pub fn radiance(&self, d: Vec3<T>) -> [T; 3] {
        let s = self.stencil(d);
        std::array::from_fn(|c| (0..4).map(|k| s.weight[k] * self.texels[s.index[k]][c]).sum())
    }

    /// Transpose of the derivative of [`Self::radiance`] with respect to the direction, as a free vector; project it on the
    /// tangent plane. The derivative with respect to the texels is [`Self::stencil`].
    ///
    /// Not differentiable on the lines between texel centres and at the poles.
    pub fn radiance_vjp(&self, d: Vec3<T>, d_radiance: [T; 3]) -> Vec3<T> {
        let ([column, row], [d_column, d_row]) = self.coordinates(d);
        let (index, [fx, fy]) = self.cell(column, row);
        let dot = |k: usize| -> T { (0..3).map(|c| d_radiance[c] * self.texels[index[k]][c]).sum() };
        let v = [dot(0), dot(1), dot(2), dot(3)];
        let along_column = (v[1] - v[0]) * (T::one() - fy) + (v[3] - v[2]) * fy;
        let along_row = (v[2] - v[0]) * (T::one() - fx) + (v[3] - v[1]) * fx;
        d_column * along_column + d_row * along_row
    }
}

impl<T: Real> Background<T> {
    /// Radiance (sRGB-encoded, 1 = white) that arrives at `_position` against the unit direction of travel `direction`. Both
    /// kinds of background lie at infinity, so the position has no effect.
    pub fn radiance(&self, _position: Vec3<T>, direction: Vec3<T>) -> [T; 3] {
        match self {
            Self::Constant(c) => *c,
            Self::Environment(map) => map.radiance(direction),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> EnvironmentMap<f64> {
        let mut m = EnvironmentMap::uniform(8, [0.0; 3]);
        for (i, t) in m.texels.iter_mut().enumerate() {
            *t = [(i as f64 * 0.37).sin(), (i as f64 * 0.91).cos(), (i * i % 17) as f64 / 17.0];
        }
        m
    }

    #[test]
    fn weights_are_a_partition_of_one_also_across_the_seam_and_the_poles() {
        for d in [vec3(-1.0, 1e-9, 0.0), vec3(-1.0, -1e-9, 0.0), vec3(0.0, 0.0, 1.0), vec3(0.6, 0.0, -0.8)] {
            let s = map().stencil(d);
            assert!((s.weight.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(s.index.iter().all(|&i| i < map().texels.len()));
        }
        let (a, b) = (map().radiance(vec3(-1.0, 1e-9, 0.0)), map().radiance(vec3(-1.0, -1e-9, 0.0)));
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-6), "no seam at azimuth ±π");
    }

    #[test]
    fn the_direction_gradient_matches_central_differences_on_the_sphere() {
        let (m, g, e) = (map(), [0.3, -0.8, 0.5], 1e-6);
        for d in [vec3(0.36, -0.48, 0.8), vec3(-0.7, 0.1, -0.4).normalized()] {
            let free = m.radiance_vjp(d, g);
            for tangent in
                [d.cross(vec3(0.0, 0.0, 1.0)).normalized(), d.cross(vec3(0.0, 1.0, 0.0)).normalized()]
            {
                let f = |s: f64| -> f64 {
                    let r = m.radiance((d + tangent * s).normalized());
                    (0..3).map(|c| g[c] * r[c]).sum()
                };
                let fd = (f(e) - f(-e)) / (2.0 * e);
                assert!((fd - free.dot(tangent)).abs() < 1e-7, "{fd} vs {}", free.dot(tangent));
            }
        }
    }
}
