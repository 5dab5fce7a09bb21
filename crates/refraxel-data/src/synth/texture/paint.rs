//! Flat designs: colours as functions of two coordinates, with structure from a thousandth of a room to all of it.

use super::color::Rgb;
use super::letters::is_inked;
use super::mosaic::Mosaic;
use super::noise::noise;
use crate::synth::hash::{cell, mix, unit};
use refraxel_core::{Vec3, vec3};

/// A flat design. Lengths are in scene units, colours linear.
#[derive(Clone, Debug)]
pub enum Paint {
    /// One colour.
    Plain(Rgb),
    /// Rectangles with joints: tiles, bricks, boards, panes.
    Tiles(Tiles),
    /// Upright stripes of these colours.
    Stripes {
        /// Colours from left to right, over and over.
        colors: Vec<Rgb>,
        /// Width of one stripe.
        width: f64,
    },
    /// Lines of capital letters.
    Print {
        /// Paper and ink.
        colors: [Rgb; 2],
        /// Distance of two lines.
        line: f64,
        /// Choice of letters.
        seed: u64,
    },
    /// Shelves of books, a spine beside the other.
    Books {
        /// Height of a shelf.
        shelf: f64,
        /// Choice of books.
        seed: u64,
    },
    /// Patches of three sizes, as foliage, stone and clouds have them.
    Speckle {
        /// Colours, the rarest at both ends.
        colors: Vec<Rgb>,
        /// Size of the largest patches.
        patch: f64,
        /// Choice of patches.
        seed: u64,
    },
    /// Cells with a motif each.
    Mosaic(Mosaic),
}

/// Rectangles in rows, parted by joints.
#[derive(Clone, Debug)]
pub struct Tiles {
    /// Width and height of one.
    pub edge: [f64; 2],
    /// How far each row is shifted against the one below, as a share of the width.
    pub shift: f64,
    /// Width of the joints.
    pub joint: f64,
    /// Colour of the joints.
    pub between: Rgb,
    /// Colours of the rectangles.
    pub colors: Vec<Rgb>,
    /// Width and height of the grain within a rectangle: equal for stone, far from equal for wood.
    pub grain: [f64; 2],
    /// Choice of colours and grain.
    pub seed: u64,
}

impl Paint {
    /// The linear colour at two coordinates.
    pub fn color(&self, at: [f64; 2]) -> Rgb {
        match self {
            Paint::Plain(color) => *color,
            Paint::Tiles(tiles) => tiles.color(at),
            Paint::Stripes { colors, width } => {
                let k = (at[0] / width).floor().rem_euclid(colors.len() as f64);
                colors[k as usize]
            }
            Paint::Print { colors, line, seed } => colors[usize::from(is_inked(*seed, at, *line))],
            Paint::Books { shelf, seed } => book(*seed, *shelf, at),
            Paint::Speckle { colors, patch, seed } => {
                let t = octaves(*seed, [at[0] / patch, at[1] / patch]);
                let k = (t * colors.len() as f64) as usize;
                colors[k.min(colors.len() - 1)].map(|c| c * (0.75 + 0.5 * t))
            }
            Paint::Mosaic(mosaic) => mosaic.color(flat(at)),
        }
    }
}

fn flat([u, v]: [f64; 2]) -> Vec3<f64> {
    vec3(u, v, 0.0)
}

/// Noise of three scales in [0, 1], spread so that both ends occur.
fn octaves(seed: u64, at: [f64; 2]) -> f64 {
    let layer = |k: u64, scale: f64| noise(mix(seed, k), flat(at), scale) - 0.5;
    (0.5 + 0.9 * layer(0, 1.0) + 0.5 * layer(1, 0.3) + 0.3 * layer(2, 0.09)).clamp(0.0, 1.0)
}

impl Tiles {
    fn color(&self, [u, v]: [f64; 2]) -> Rgb {
        let row = (v / self.edge[1]).floor();
        let along = u / self.edge[0] + self.shift * row;
        let [x, y] = [along.rem_euclid(1.0) * self.edge[0], v - row * self.edge[1]];
        if x.min(self.edge[0] - x).min(y).min(self.edge[1] - y) < 0.5 * self.joint {
            return self.between;
        }
        let tile = cell(self.seed, [along.floor() as i64, row as i64, 0]);
        let grain = noise(mix(self.seed, tile), flat([u / self.grain[0], v / self.grain[1]]), 1.0);
        let fine = noise(tile, flat([4.0 * u / self.grain[0], 4.0 * v / self.grain[1]]), 1.0);
        let light = 0.72 + 0.12 * unit(mix(tile, 1)) + 0.2 * grain + 0.12 * fine;
        self.colors[(tile % self.colors.len() as u64) as usize].map(|c| c * light)
    }
}

/// A wall of books: spines of chosen width, height and colour, each with two bands and a title that runs upwards.
fn book(seed: u64, shelf: f64, [u, v]: [f64; 2]) -> Rgb {
    const BOARD: Rgb = [0.16, 0.085, 0.04];
    const SHADOW: Rgb = [0.03, 0.02, 0.015];
    let row = (v / shelf).floor();
    let y = v / shelf - row;
    if y < 0.06 {
        return BOARD;
    }
    // A slot holds two books that part it at a chosen place.
    let slot = shelf * 0.24;
    let (at, k) = ((u / slot).rem_euclid(1.0), (u / slot).floor());
    let parting = 0.35 + 0.3 * unit(cell(seed, [k as i64, row as i64, 1]));
    let second = at >= parting;
    let (x, width) = if second { (at - parting, 1.0 - parting) } else { (at, parting) };
    let spine = cell(seed, [k as i64, row as i64, 2 + i64::from(second)]);
    let height = 0.62 + 0.32 * unit(mix(spine, 1));
    let gap = 0.06 * unit(mix(spine, 2));
    if y > height || x < gap * width {
        return SHADOW;
    }
    let share = x / width;
    let round = 0.55 + 1.6 * share * (1.0 - share);
    let color = [2, 3, 4].map(|c| (0.03 + 0.6 * unit(mix(spine, c)).powi(2)) * round);
    let ink = [5, 6, 7].map(|c| (0.4 + 0.5 * unit(mix(spine, c))) * round);
    let band = [0.16, 0.84].iter().any(|b| (y / height - b).abs() < 0.018);
    let title = (0.25..0.75).contains(&(y / height)) && (0.3..0.7).contains(&share);
    // The letters stand as high as the middle of the spine is wide.
    let letters =
        title && is_inked(spine, [y * shelf, (share - 0.3) * width * slot - slot], 0.57 * width * slot);
    if band || letters { ink } else { color }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spread(paint: &Paint, step: f64) -> f64 {
        let at = |k: u32| paint.color([f64::from(k) * step, 0.37 + f64::from(k) * 0.7 * step])[1];
        let all: Vec<f64> = (0..4000).map(at).collect();
        assert!(all.iter().all(|c| (0.0..=1.3).contains(c)));
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (all.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
    }

    #[test]
    fn designs_vary_over_centimetres_and_over_the_room() {
        let colors = vec![[0.1; 3], [0.7; 3], [0.4; 3]];
        let tiles = Tiles {
            edge: [0.4, 0.2],
            shift: 0.5,
            joint: 0.02,
            between: [0.2; 3],
            colors: colors.clone(),
            grain: [0.1, 0.1],
            seed: 1,
        };
        let designs = [
            Paint::Tiles(tiles),
            Paint::Stripes { colors: colors.clone(), width: 0.1 },
            Paint::Print { colors: [[0.9; 3], [0.05; 3]], line: 0.1, seed: 2 },
            Paint::Books { shelf: 0.5, seed: 3 },
            Paint::Speckle { colors, patch: 0.5, seed: 4 },
        ];
        for paint in designs {
            for step in [2e-3, 0.3] {
                assert!(spread(&paint, step) > 0.05, "{paint:?} {step}: {}", spread(&paint, step));
            }
        }
    }
}
