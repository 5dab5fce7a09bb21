//! Depth as 16-bit numbers for programs, and as colours for people.

use crate::canvas::Colour;
use crate::colour_map::ColourMap;
use refraxel_core::Domain;
use refraxel_data::NamedCamera;
use refraxel_train::evaluation::Rendering;

/// Less opaque pixels do not count for the range of the colours.
pub const OPAQUE: f32 = 0.5;
/// Shares of the depths of a picture at which its colours begin and end.
const QUANTILES: [f64; 2] = [0.02, 0.98];
/// Opacities between which the colours of previews appear: at edges and in what is half transparent, depth is known, too.
const APPEARS: [f32; 2] = [0.02, 0.3];
/// Largest depth of a contracted grid, in distances to the far side of its box; the grid itself has no end.
const FAR: f64 = 4.0;

/// How depths are written.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    /// Scene units per step of the 16-bit pictures.
    pub unit: f64,
    /// Depths of the first and last colour of the previews, from the first view [scene unit].
    range: Option<[f32; 2]>,
}

impl Depth {
    /// The finest unit of 1, 2 or 5 times a power of ten in which no view of the grid exceeds 16 bits.
    pub fn for_views(cameras: &[NamedCamera], domain: &Domain<f32>) -> Self {
        let bounds = domain.bounds.cast::<f64>();
        let (middle, radius) = (bounds.center(), 0.5 * bounds.extent().length());
        let farthest = cameras
            .iter()
            .map(|c| (c.camera.world_from_camera.translation - middle).length())
            .fold(0.0, f64::max);
        let reach = if domain.extent.is_unbounded() { FAR } else { 1.0 };
        Self { unit: round_up(reach * (farthest + radius) / 65_534.0), range: None }
    }

    /// Takes the range of the colours of all previews from the first view with any depth.
    pub fn choose_range(&mut self, depths: impl Iterator<Item = Option<f32>>) {
        if self.range.is_some() {
            return;
        }
        self.range = range(depths.flatten().collect());
    }

    /// Bytes of the 16-bit samples, in the machine's order.
    pub fn samples(&self, depths: impl Iterator<Item = f32>) -> Vec<u8> {
        let code = |d: f32| (f64::from(d) / self.unit).round().clamp(0.0, 65_535.0) as u16;
        depths.flat_map(|d| code(d).to_ne_bytes()).collect()
    }

    /// Near is yellow, far is violet, and a pixel without depth is white.
    pub fn colours(&self, depths: impl Iterator<Item = Option<f32>>) -> Vec<Colour> {
        depths.map(|d| d.map_or([255; 3], |d| self.colour(d, 1.0))).collect()
    }

    /// The same of a rendering, whose transparent pixels fade into white.
    pub fn preview(&self, r: &Rendering) -> Vec<Colour> {
        r.depth.iter().zip(&r.opacity).map(|(&d, &opacity)| self.colour(d, opacity)).collect()
    }

    fn colour(&self, depth: f32, opacity: f32) -> Colour {
        let Some([near, far]) = self.range else { return [255; 3] };
        let share = ((opacity - APPEARS[0]) / (APPEARS[1] - APPEARS[0])).clamp(0.0, 1.0);
        let colour = ColourMap::Viridis.at((far - depth) / (far - near));
        colour.map(|c| (255.0 + (f32::from(c) - 255.0) * share).round() as u8)
    }
}

/// The depths of the first and of the last colour of a picture; `None` without any.
pub fn range(mut depths: Vec<f32>) -> Option<[f32; 2]> {
    depths.sort_by(f32::total_cmp);
    let at = |share: f64| depths.get((share * (depths.len() as f64 - 1.0)) as usize).copied();
    let [near, far] = QUANTILES.map(at);
    near.zip(far).map(|(near, far)| [near, far.max(near.next_up())])
}

/// The depths of the opaque pixels of a rendering.
pub fn opaque(r: &Rendering) -> impl Iterator<Item = Option<f32>> {
    r.depth.iter().zip(&r.opacity).map(|(&d, &a)| (a > OPAQUE).then_some(d))
}

/// The next 1, 2 or 5 times a power of ten.
fn round_up(x: f64) -> f64 {
    let power = 10f64.powf(x.max(f64::MIN_POSITIVE).log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|&v| v >= x).unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_round_and_large_enough() {
        assert!(
            [(6.5 / 65534.0, 1e-4), (7e-5, 1e-4), (1.2e-3, 2e-3), (0.04, 0.05)]
                .iter()
                .all(|&(x, unit): &(f64, f64)| (round_up(x) - unit).abs() < 1e-12)
        );
    }

    #[test]
    fn previews_have_no_holes_where_something_is_half_transparent() {
        let depth = Depth { unit: 0.01, range: Some([1.0, 3.0]) };
        assert_eq!(depth.colour(2.0, 0.35), depth.colour(2.0, 1.0));
        assert_eq!(depth.colour(2.0, 0.0), [255; 3]);
        let between = depth.colour(2.0, 0.15);
        let full = depth.colour(2.0, 1.0);
        assert!((0..3).all(|c| full[c] < between[c] && between[c] < 255));
    }

    #[test]
    fn samples_are_steps_of_the_unit_and_nothing_is_zero() {
        let depth = Depth { unit: 0.01, range: None };
        let bytes = depth.samples([0.0, 1.234, 1e9].into_iter());
        let samples: Vec<u16> = bytes.as_chunks().0.iter().map(|b| u16::from_ne_bytes(*b)).collect();
        assert_eq!(samples, [0, 123, 65_535]);
    }
}
