//! The axis of a body of revolution.

use refraxel_core::{LevelSet, Vec3};

/// The line around which a body is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    /// A point on it.
    pub at: Vec3<f32>,
    /// Unit vector along it.
    pub up: Vec3<f32>,
}

impl Axis {
    /// Distance from it, and height along it.
    pub(crate) fn place(&self, x: Vec3<f32>) -> [f32; 2] {
        let height = self.up.dot(x - self.at);
        [(x - self.at - self.up * height).length(), height]
    }

    /// Gives each node of a surface the mean of the values around the axis, in bins of a voxel that overlap: what moves so stays a body
    /// of revolution.
    pub(crate) fn average(&self, surface: &LevelSet<f32>, values: &mut [f32]) {
        let voxel = surface.voxel();
        let places: Vec<[f32; 2]> =
            (0..values.len()).map(|j| self.place(surface.position(j)).map(|d| d / voxel)).collect();
        let low = places.iter().fold(f32::MAX, |low, p| low.min(p[1])).floor();
        let [across, along] = [0, 1].map(|a| places.iter().fold(0.0_f32, |most, p| most.max(p[a])));
        let (across, along) = (across as usize + 2, (along - low) as usize + 2);
        let corners = |[radius, height]: [f32; 2]| {
            let (r, h) = (radius, height - low);
            let (i, j) = (r as usize, h as usize);
            let at = [j * across + i, j * across + i + 1, (j + 1) * across + i, (j + 1) * across + i + 1];
            let (s, t) = (r.fract(), h.fract());
            at.into_iter().zip([(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t])
        };
        let mut sums = vec![[0.0_f32; 2]; across * (along + 1)];
        for (place, value) in places.iter().zip(&*values) {
            for (bin, weight) in corners(*place) {
                sums[bin][0] += weight * value;
                sums[bin][1] += weight;
            }
        }
        let mean = |[sum, weight]: [f32; 2]| if weight > 0.0 { sum / weight } else { 0.0 };
        for (place, value) in places.iter().zip(values) {
            *value = corners(*place).map(|(bin, weight)| weight * mean(sums[bin])).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, vec3};

    #[test]
    fn averages_do_not_depend_on_the_angle_and_keep_what_does_not() {
        let axis = Axis { at: vec3(0.1, -0.05, 0.0), up: vec3(0.1, 0.0, 1.0).normalized() };
        let bounds = Aabb::cube(1.0);
        let surface = LevelSet::from_samples(bounds, [33; 3], |x| x.length() - 0.5);
        let nodes = surface.coefficients().len();
        let of = |f: &dyn Fn([f32; 2], Vec3<f32>) -> f32| -> Vec<f32> {
            (0..nodes).map(|j| surface.position(j)).map(|x| f(axis.place(x), x)).collect()
        };
        let round = of(&|[radius, height], _| radius + 0.5 * height);
        let mut once = round.clone();
        axis.average(&surface, &mut once);
        let error = round.iter().zip(&once).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(error < surface.voxel(), "{error}");
        let mut waves = of(&|_, x| if (x - axis.at).y > 0.0 { 1.0 } else { -1.0 });
        axis.average(&surface, &mut waves);
        let inside = (0..nodes).filter(|&j| (0.2..0.6).contains(&axis.place(surface.position(j))[0]));
        let most = inside.map(|j| waves[j].abs()).fold(0.0, f32::max);
        assert!(most < 0.25, "{most}");
    }
}
