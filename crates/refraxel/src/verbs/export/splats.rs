//! A radiance field as 3D Gaussians, in the PLY layout of Gaussian splatting or as [SPZ](super::spz): one Gaussian for each
//! voxel that matters.
//!
//! Colour needs no conversion: theory (3.6) and (3.7) have the basis, the order, the signs, the direction and the clamp of
//! Gaussian splatting. Opacity is such that a ray through a lattice of equal Gaussians keeps the transmittance of the field.
//!
//! Source of layout and rendering: Kerbl et al. 2023, 3D Gaussian Splatting for Real-Time Radiance Field Rendering.

use super::ellipsoid::Ellipsoid;
use super::spz;
use crate::table::count;
use crate::verbs::ply_header::{BINARY, Element, write_header};
use rayon::prelude::*;
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::{Background, Extent, Vec3, VoxelField};
use refraxel_data::{LocalOrigin, quantize};
use refraxel_train::model::Model;
use refraxel_train::model::opaque::optical_depth;
use std::f64::consts::PI;
use std::io::{self, Write};

/// Standard deviation of a Gaussian [voxel]: that of the weights of trilinear interpolation, 1/√6. Pictures of the splats are nearest
/// to photographs at 0.35 to 0.4; thinner ones have gaps between them, wider ones blur.
const SPREAD: f64 = 0.4;
/// Renderers cut opacities off above this, and pass over those below the other.
const OPACITIES: [f64; 2] = [1.0 / 255.0, 0.99];
/// Voxels that give no camera a larger share of a pixel's light are left out.
const SEEN: f32 = 0.01;

/// The Gaussians of a field.
pub(super) struct Splats {
    /// Voxels of the field and their opacities, the most important first.
    chosen: Vec<(usize, f64)>,
    /// Share of what all Gaussians give to pixels that the chosen ones give [1].
    pub(super) share: f64,
    /// Gaussians that the limit has left out.
    pub(super) left_out: usize,
}

impl Splats {
    /// At most `most` Gaussians of the voxels of most weight in any camera; without `weights`, of the most opaque ones.
    pub(super) fn of(field: &VoxelField<f32>, weights: Option<&[f32]>, most: usize) -> Self {
        let opacity = Opacities::new();
        let n = field.domain.resolution;
        let gaussian = |voxel: usize| {
            let weight = weights.map_or(1.0, |weights| weights[voxel]);
            let is_node = (0..3).all(|a| field.map.node(voxel)[a] < n[a]);
            let own = opacity.of(layer(field, voxel));
            (weight >= SEEN && is_node && own >= OPACITIES[0]).then_some((
                voxel,
                own,
                f64::from(weight) * own,
            ))
        };
        let all = (BRICK_VOXELS..field.map.voxels()).into_par_iter();
        let mut all: Vec<(usize, f64, f64)> = all.filter_map(gaussian).collect();
        all.sort_by(|a, b| b.2.total_cmp(&a.2));
        let sum = |part: &[(usize, f64, f64)]| part.iter().map(|(_, _, weight)| weight).sum::<f64>();
        let kept = most.min(all.len());
        let share = if all.is_empty() { 1.0 } else { sum(&all[..kept]) / sum(&all) };
        let chosen = all[..kept].iter().map(|&(voxel, own, _)| (voxel, own)).collect();
        Self { chosen, share, left_out: all.len() - kept }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.chosen.len()
    }

    /// What the file lacks of a scene.
    pub(super) fn notes(&self, model: &Model) -> Vec<String> {
        let mut notes = Vec::new();
        if self.left_out > 0 {
            notes.push(format!(
                "{} Gaussians of little weight are left out; the others give {:.1} % of the light; --points N keeps more",
                count(self.left_out as u64),
                100.0 * self.share
            ));
        }
        if !model.refraction.is_none() {
            notes.push("glass is left out: Gaussians neither bend nor reflect light".to_owned());
        }
        match &model.background {
            Background::Environment(_) => notes.push("the background beyond the grid is left out".to_owned()),
            Background::Constant(colour) => notes.push(format!(
                "the background of the run has the sRGB colour ({}), which has to be set in the viewer",
                colour.map(|c| quantize(c).to_string()).join(", ")
            )),
        }
        notes
    }

    /// Writes them as SPZ, in world coordinates relative to the run's origin.
    pub(super) fn write_spz(&self, field: &VoxelField<f32>, out: &mut dyn Write) -> io::Result<spz::Lost> {
        let all = self.chosen.par_iter().map(|&(voxel, opacity)| Gaussian::of(field, voxel, opacity));
        spz::write(&all.collect::<Vec<_>>(), field.degree, out)
    }

    /// Writes them as PLY in world coordinates relative to `origin`: the layout has single precision only.
    pub(super) fn write(
        &self,
        field: &VoxelField<f32>,
        origin: LocalOrigin,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let rest = 3 * (field.degree.basis() - 1);
        let mut comments = vec!["3D Gaussians by refraxel, world coordinates of the dataset".to_owned()];
        if !origin.is_of_world() {
            let [x, y, z] = origin.place().to_array();
            comments.push(format!("relative to {x} {y} {z}"));
        }
        let numbered = |name: &'static str, n: usize| (0..n).map(move |k| format!("{name}_{k}"));
        let vertex = Element::new("vertex", self.len())
            .with("float", ["x", "y", "z", "nx", "ny", "nz"])
            .with("float", numbered("f_dc", 3).chain(numbered("f_rest", rest)))
            .with("float", ["opacity"])
            .with("float", numbered("scale", 3).chain(numbered("rot", 4)));
        write_header(BINARY, &comments, &[vertex], out)?;
        for &(voxel, opacity) in &self.chosen {
            for number in Gaussian::of(field, voxel, opacity).numbers() {
                out.write_all(&number.to_le_bytes())?;
            }
        }
        Ok(())
    }
}

/// One of them, in the numbers of the PLY layout.
pub(super) struct Gaussian {
    /// Its middle [scene unit].
    pub(super) place: [f32; 3],
    /// Logit of its opacity.
    pub(super) logit: f32,
    /// Logarithms of its standard deviations along its axes.
    pub(super) scales: [f32; 3],
    /// The rotation of its axes, as a unit quaternion (w, x, y, z).
    pub(super) rotation: [f32; 4],
    /// Spherical harmonics of red, of green and of blue, without padding.
    pub(super) colour: Vec<f32>,
}

impl Gaussian {
    fn of(field: &VoxelField<f32>, voxel: usize, opacity: f64) -> Self {
        let domain = field.domain.cast::<f64>();
        let x = domain.position(Vec3::from(field.map.node(voxel).map(f64::from)));
        // A ball in node coordinates.
        let axes = [0, 1, 2].map(|a| domain.node_vjp(x, Vec3::from([0, 1, 2].map(|b| f64::from(a == b)))));
        let Ellipsoid { radii, rotation } = Ellipsoid::of(axes);
        Self {
            place: x.cast::<f32>().to_array(),
            logit: (opacity / (1.0 - opacity)).ln() as f32,
            scales: radii.map(|r| (SPREAD * r).ln() as f32),
            rotation: rotation.map(|q| q as f32),
            colour: field.colour[voxel * field.degree.stride()..][..3 * field.degree.basis()].to_vec(),
        }
    }

    /// In the order of the header.
    fn numbers(&self) -> Vec<f32> {
        let channels = || self.colour.chunks_exact(self.colour.len() / 3);
        let dc: Vec<f32> = channels().map(|c| c[0]).collect();
        let rest: Vec<f32> = channels().flat_map(|c| &c[1..]).copied().collect();
        [&self.place[..], &[0.0; 3], &dc, &rest, &[self.logit], &self.scales, &self.rotation].concat()
    }
}

/// Optical depth of one layer of voxels, for rays that come from the middle of the box.
fn layer(field: &VoxelField<f32>, voxel: usize) -> f64 {
    let (domain, depth) = (&field.domain, f64::from(optical_depth(field, voxel)));
    if domain.extent != Extent::Contracted {
        return depth; // voxels are cubes, or density counts per voxel
    }
    let x = domain.position(Vec3::from(field.map.node(voxel).map(|n| n as f32)));
    let away = x - domain.bounds.center();
    let away = if away.length() > 0.0 { away.normalized() } else { Vec3::from([1.0, 0.0, 0.0]) };
    depth / f64::from(domain.node_jvp(x, away).length() * domain.voxel())
}

/// Optical depth of a layer of Gaussians by their opacity.
///
/// A layer with one Gaussian of opacity o and standard deviation k per unit square has the mean optical depth
/// ∫ −ln(1 − o e^(−r²/2k²)) dA = 2π k² Li₂(o), the dilogarithm.
struct Opacities(Vec<f64>);

impl Opacities {
    const STEPS: usize = 1024;

    fn new() -> Self {
        let at = |k: usize| OPACITIES[1] * k as f64 / Self::STEPS as f64;
        Self((0..=Self::STEPS).map(|k| 2.0 * PI * SPREAD * SPREAD * dilogarithm(at(k))).collect())
    }

    /// The opacity for an optical depth, at most the largest that renderers know.
    fn of(&self, depth: f64) -> f64 {
        let above = self.0.partition_point(|&d| d < depth);
        if above == 0 || above > Self::STEPS {
            return OPACITIES[1] * (above.min(Self::STEPS) as f64 / Self::STEPS as f64);
        }
        let [low, high] = [self.0[above - 1], self.0[above]];
        let share = (depth - low) / (high - low);
        OPACITIES[1] * (above as f64 - 1.0 + share) / Self::STEPS as f64
    }
}

/// Li₂(z) = Σ zⁿ/n² for z in [0, 1).
fn dilogarithm(z: f64) -> f64 {
    // Above 1/2 by Li₂(z) = π²/6 − ln z ln(1 − z) − Li₂(1 − z), for the sum to converge.
    if z > 0.5 {
        return PI * PI / 6.0 - z.ln() * (1.0 - z).ln() - dilogarithm(1.0 - z);
    }
    (1..60).map(|n| z.powi(n) / f64::from(n * n)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, BrickMap, Domain, ShDegree, vec3};

    /// A uniform field with this optical depth per voxel.
    fn uniform(depth: f64, extent: Extent) -> VoxelField<f32> {
        let bounds = Aabb::cube(1.0);
        let domain = Domain { bounds, extent, resolution: [16; 3] };
        let (map, degree) = (BrickMap::dense([16; 3]), ShDegree::new(1).unwrap());
        let mut field = VoxelField::uniform(domain, map, degree, 0.0);
        let softplus = depth / f64::from(field.density_scale() * field.domain.voxel());
        field.density[BRICK_VOXELS..].fill(softplus.exp_m1().ln() as f32);
        field
    }

    /// The numbers of all Gaussians in a file, by the names of its header.
    fn read(bytes: &[u8]) -> (Vec<String>, Vec<Vec<f32>>) {
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let header = std::str::from_utf8(&bytes[..end]).unwrap();
        let names: Vec<String> =
            header.lines().filter_map(|l| l.strip_prefix("property float ")).map(str::to_owned).collect();
        let numbers: Vec<f32> =
            bytes[end..].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        let count = header.lines().find_map(|l| l.strip_prefix("element vertex ")).unwrap();
        let rows: Vec<Vec<f32>> = numbers.chunks_exact(names.len()).map(<[f32]>::to_vec).collect();
        assert_eq!(rows.len(), count.parse::<usize>().unwrap());
        (names, rows)
    }

    fn written(field: &VoxelField<f32>, most: usize) -> (Vec<String>, Vec<Vec<f32>>) {
        let mut bytes = Vec::new();
        Splats::of(field, None, most).write(field, LocalOrigin::default(), &mut bytes).unwrap();
        read(&bytes)
    }

    #[test]
    fn a_slab_of_gaussians_lets_through_what_the_field_does() {
        for depth in [0.02, 0.1, 0.4, 1.0] {
            let (names, rows) = written(&uniform(depth, Extent::Bounded), usize::MAX);
            let at = |name: &str| names.iter().position(|n| n == name).unwrap();
            let (x, y, opacity, scale) = (at("x"), at("y"), at("opacity"), at("scale_0"));
            // Rays along z, evenly over a voxel near the middle: the mean optical depth of a layer.
            let per_ray = |k: usize| {
                let [u, v] = [k % 4, k / 4].map(|i| (i as f64 + 0.5) / 4.0 * 2.0 / 15.0);
                let through = |row: &Vec<f32>| {
                    let [x, y, o, s] = [x, y, opacity, scale].map(|k| f64::from(row[k]));
                    let alpha = (1.0 + (-o).exp()).recip();
                    let r2 = ((x - u).powi(2) + (y - v).powi(2)) / s.exp().powi(2);
                    (1.0 - alpha * (-0.5 * r2).exp()).ln()
                };
                rows.iter().map(through).sum::<f64>() / -16.0 / depth
            };
            let rays: Vec<f64> = (0..16).map(per_ray).collect();
            let mean = rays.iter().sum::<f64>() / 16.0;
            assert!((mean - 1.0).abs() < 0.02, "{depth}: {mean}");
            assert!(rays.iter().all(|r| (r - 1.0).abs() < 0.5), "{depth}: {rays:?}");
        }
        // Nothing is more opaque than renderers allow.
        let (names, rows) = written(&uniform(9.0, Extent::Bounded), usize::MAX);
        let opacity = rows[0][names.iter().position(|n| n == "opacity").unwrap()];
        assert!((opacity - (0.99_f32 / 0.01).ln()).abs() < 1e-3, "{opacity}");
    }

    #[test]
    fn the_layout_is_that_of_gaussian_splatting() {
        let mut field = uniform(0.5, Extent::Bounded);
        let voxel = field.map.voxel([3, 5, 7]);
        let stride = field.degree.stride();
        for (k, value) in field.colour[voxel * stride..][..12].iter_mut().enumerate() {
            *value = k as f32;
        }
        let (names, rows) = written(&field, usize::MAX);
        let expected = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 f_rest_1 f_rest_2 f_rest_3 f_rest_4 f_rest_5 f_rest_6 \
                        f_rest_7 f_rest_8 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
        assert_eq!((names.join(" ").as_str(), rows.len()), (expected, 4096));
        let place = [3.0, 5.0, 7.0].map(|n| n * 2.0 / 15.0 - 1.0_f32);
        let row = rows.iter().find(|r| (0..3).all(|a| (r[a] - place[a]).abs() < 1e-6)).unwrap();
        // Red, green and blue of the first coefficient; then the others of red, of green, of blue.
        assert_eq!(row[6..18], [0.0, 4.0, 8.0, 1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 9.0, 10.0, 11.0]);
        let voxel = (SPREAD * 2.0 / 15.0).ln() as f32;
        assert!(row[19..22].iter().all(|s| (s - voxel).abs() < 1e-5), "{row:?}");
        assert_eq!(row[22..], [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn what_nobody_sees_is_left_out_and_the_limit_keeps_what_matters_most() {
        let field = uniform(0.5, Extent::Bounded);
        let mut weights = vec![0.0; field.map.voxels()];
        let [a, b, c] = [[1, 2, 3], [8, 8, 8], [15, 0, 4]].map(|n| field.map.voxel(n));
        (weights[a], weights[b], weights[c]) = (0.2, 0.7, 0.1);
        let all = Splats::of(&field, Some(&weights), usize::MAX);
        assert_eq!((all.len(), all.left_out, all.share), (3, 0, 1.0));
        let two = Splats::of(&field, Some(&weights), 2);
        assert_eq!(two.chosen.iter().map(|c| c.0).collect::<Vec<_>>(), [b, a]);
        assert!((two.share - 0.9).abs() < 1e-6 && two.left_out == 1, "{}", two.share);
    }

    #[test]
    fn far_gaussians_of_a_contracted_grid_are_as_long_as_its_voxels() {
        let field = uniform(0.5, Extent::Contracted);
        let voxel = field.map.voxel([14, 7, 7]);
        let row = Gaussian::of(&field, voxel, 0.5).numbers();
        let domain = field.domain.cast::<f64>();
        let [near, far] = [13.99, 14.01].map(|x| domain.position(vec3(x, 7.0, 7.0)));
        let longest = row[19..22].iter().copied().fold(f32::MIN, f32::max);
        let expected = SPREAD * (far - near).length() / 0.02;
        assert!((f64::from(longest).exp() / expected - 1.0).abs() < 0.01, "{} {expected}", longest.exp());
    }
}
