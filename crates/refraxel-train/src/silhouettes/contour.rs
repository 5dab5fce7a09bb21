//! From antialiased coverage to the signed distance of the ½ contour in the image.
//!
//! A pixel that the edge crosses has a coverage 0 < a < 1 and a gradient; for a straight edge of that direction the
//! distance from the pixel's centre to the edge follows exactly. These short pieces of edge, one per crossed pixel, are
//! what all other pixels measure their distance to. Between a full and an empty neighbour (masks without antialiasing)
//! the edge lies half-way. Source: Gustavson & Strand 2011, anti-aliased Euclidean distance transform.

/// A short straight piece of the contour.
#[derive(Clone, Copy)]
struct Piece {
    /// Its middle [pixel].
    middle: [f32; 2],
    /// Unit normal, pointing out of the mask.
    normal: [f32; 2],
}

/// Half the length of a piece [pixel]: enough to close the contour, little enough not to stick out of a small disc.
const HALF_LENGTH: f32 = 0.5;
/// Coverages up to this count as empty, and from 1 minus this on as full: rounding of 8 bits.
const SATURATED: f32 = 1.5 / 255.0;

/// Signed distance [pixel] from the centre of each pixel to the contour of coverage ½, negative inside, rows from the top.
///
/// Beyond any contour (a mask all empty or all full) it is ± (width + height). Measured on
/// antialiased discs and half-planes: mean error below 0.02 pixel, root mean square below 0.05.
pub(super) fn signed_distance(coverage: &[u8], [width, height]: [usize; 2]) -> Vec<f32> {
    let mask = Coverage { values: coverage, size: [width, height] };
    let pieces: Vec<Option<Piece>> = (0..width * height).map(|i| mask.piece(i % width, i / width)).collect();
    let nearest = nearest_set(&pieces, [width, height]);
    let far = (width + height) as f32;
    let distance = |i: usize| {
        let sign = if mask.at(i % width, i / width) >= 0.5 { -1.0 } else { 1.0 };
        let at = [(i % width) as f32 + 0.5, (i / width) as f32 + 0.5];
        let Some(found) = nearest[i] else { return sign * far };
        let (x, y) = (found as usize % width, found as usize / width);
        let around = (y.saturating_sub(1)..(y + 2).min(height))
            .flat_map(|y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x));
        let squared =
            around.filter_map(|k| pieces[k]).map(|p| p.squared_distance(at)).fold(f32::MAX, f32::min);
        sign * squared.sqrt()
    };
    (0..width * height).map(distance).collect()
}

impl Piece {
    fn squared_distance(&self, at: [f32; 2]) -> f32 {
        let d = [at[0] - self.middle[0], at[1] - self.middle[1]];
        let across = d[0] * self.normal[0] + d[1] * self.normal[1];
        let along = (d[0] * self.normal[1] - d[1] * self.normal[0]).abs();
        let beyond = (along - HALF_LENGTH).max(0.0);
        across * across + beyond * beyond
    }
}

struct Coverage<'a> {
    values: &'a [u8],
    size: [usize; 2],
}

impl Coverage<'_> {
    fn at(&self, x: usize, y: usize) -> f32 {
        f32::from(self.values[y * self.size[0] + x]) / 255.0
    }

    /// Coverage at an offset of −1, 0 or 1; the border repeats.
    fn near(&self, x: usize, y: usize, dx: isize, dy: isize) -> f32 {
        let x = x.saturating_add_signed(dx).min(self.size[0] - 1);
        self.at(x, y.saturating_add_signed(dy).min(self.size[1] - 1))
    }

    /// The piece of contour that belongs to a pixel.
    fn piece(&self, x: usize, y: usize) -> Option<Piece> {
        let a = self.at(x, y);
        let is_mixed = a > SATURATED && a < 1.0 - SATURATED;
        let faces_opposite = || {
            [(1, 0), (-1, 0), (0, 1), (0, -1)]
                .iter()
                .any(|&(i, j)| (self.near(x, y, i, j) - a).abs() >= 1.0 - 2.0 * SATURATED)
        };
        if !is_mixed && !faces_opposite() {
            return None;
        }
        // Sobel; the normal points to less coverage.
        let n = |i, j| self.near(x, y, i, j);
        let gx = n(-1, -1) + 2.0 * n(-1, 0) + n(-1, 1) - n(1, -1) - 2.0 * n(1, 0) - n(1, 1);
        let gy = n(-1, -1) + 2.0 * n(0, -1) + n(1, -1) - n(-1, 1) - 2.0 * n(0, 1) - n(1, 1);
        let length = gx.hypot(gy);
        if length < 1e-3 {
            return None; // a thin line or a lone pixel has no side
        }
        let normal = [gx / length, gy / length];
        let outward = -edge_distance(normal, a);
        let middle = [x as f32 + 0.5 + outward * normal[0], y as f32 + 0.5 + outward * normal[1]];
        Some(Piece { middle, normal })
    }
}

/// Signed distance [pixel] from a pixel's centre to a straight edge that covers the share `a` of the pixel, negative
/// where more than half is covered. `normal` is the edge's unit normal.
fn edge_distance(normal: [f32; 2], a: f32) -> f32 {
    let (p, q) = (normal[0].abs().max(normal[1].abs()), normal[0].abs().min(normal[1].abs()));
    let corner = 0.5 * q / p; // coverage when the edge passes through a corner
    if a < corner {
        0.5 * (p + q) - (2.0 * p * q * a).sqrt()
    } else if a <= 1.0 - corner {
        (0.5 - a) * p
    } else {
        -0.5 * (p + q) + (2.0 * p * q * (1.0 - a)).sqrt()
    }
}

/// For each pixel the index of the nearest one that is set, by its centre; `None` when none is.
/// Source: Felzenszwalb & Huttenlocher 2012, columns, then rows by lower envelopes of parabolas.
fn nearest_set<T>(set: &[Option<T>], [width, height]: [usize; 2]) -> Vec<Option<u32>> {
    let mut column = vec![None; width * height]; // row of the nearest set pixel of the same column
    for x in 0..width {
        let mut last: Option<usize> = None;
        for y in 0..height {
            last = if set[y * width + x].is_some() { Some(y) } else { last };
            column[y * width + x] = last;
        }
        for y in (0..height.saturating_sub(1)).rev() {
            let below = column[(y + 1) * width + x];
            let here = &mut column[y * width + x];
            let is_nearer = |row: usize| here.is_none_or(|h: usize| row.abs_diff(y) < y.abs_diff(h));
            if let Some(row) = below.filter(|&row| is_nearer(row)) {
                *here = Some(row);
            }
        }
    }
    let mut nearest = vec![None; width * height];
    // Parabola x² + height of each column, and where its reign begins.
    let mut envelope: Vec<(usize, f32, f32)> = Vec::with_capacity(width);
    for y in 0..height {
        envelope.clear();
        for x in 0..width {
            let Some(row) = column[y * width + x] else { continue };
            let value = (row.abs_diff(y).pow(2) + x * x) as f32;
            let mut start = f32::NEG_INFINITY;
            while let Some(&(x0, value0, start0)) = envelope.last() {
                start = (value - value0) / (2.0 * (x - x0) as f32);
                if start > start0 {
                    break;
                }
                envelope.pop();
                start = f32::NEG_INFINITY;
            }
            envelope.push((x, value, start));
        }
        let mut k = 0;
        for x in 0..width {
            while envelope.get(k + 1).is_some_and(|e| e.2 <= x as f32) {
                k += 1;
            }
            let source = envelope.get(k).and_then(|e| Some((e.0, column[y * width + e.0]?)));
            nearest[y * width + x] = source.map(|(x, row)| (row * width + x) as u32);
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::super::around::cover;
    use super::*;

    fn errors(size: [usize; 2], distance: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let found = signed_distance(&cover(size, 16, |x, y| distance(x, y) < 0.0), size);
        let centre = |i: usize| distance((i % size[0]) as f64 + 0.5, (i / size[0]) as f64 + 0.5);
        (0..found.len()).map(|i| f64::from(found[i]) - centre(i)).collect()
    }

    #[test]
    fn distance_to_a_disc_has_no_bias() {
        for radius in [6.3, 14.8] {
            let e = errors([48, 40], |x, y| (x - 23.7).hypot(y - 19.2) - radius);
            let mean = e.iter().sum::<f64>() / e.len() as f64;
            let square = (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt();
            assert!(mean.abs() < 0.02 && square < 0.05, "mean {mean}, root mean square {square}");
        }
    }

    #[test]
    fn distance_to_a_half_plane_is_right_to_a_twentieth_of_a_pixel() {
        let n: [f64; 2] = [0.8, 0.6];
        let e = errors([40, 40], |x, y| n[0] * (x - 20.0) + n[1] * (y - 20.0));
        let worst = (0..e.len()).filter(|i| (12..28).contains(&(i % 40)) && (12..28).contains(&(i / 40)));
        let worst = worst.map(|i| e[i].abs()).fold(0.0, f64::max);
        assert!(worst < 0.06, "{worst}");
    }

    #[test]
    fn without_antialiasing_the_edge_lies_between_the_pixels() {
        let mask: Vec<u8> = (0..64).map(|i| if i % 8 < 3 { 255 } else { 0 }).collect();
        let d = signed_distance(&mask, [8, 8]);
        assert_eq!(d[8 * 4..][..8], [-2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5, 4.5]);
    }

    #[test]
    fn empty_and_full_masks_have_no_contour_nearby() {
        assert_eq!(signed_distance(&[0; 6], [3, 2]), [5.0; 6]);
        assert_eq!(signed_distance(&[255; 6], [3, 2]), [-5.0; 6]);
    }

    #[test]
    fn the_nearest_pixel_is_the_nearest_by_exhaustive_search() {
        let size = [13, 9];
        let set: Vec<Option<()>> = (0..117).map(|i| (i * i % 17 == 3).then_some(())).collect();
        let squared =
            |a: usize, b: usize| (a % 13).abs_diff(b % 13).pow(2) + (a / 13).abs_diff(b / 13).pow(2);
        for (i, found) in nearest_set(&set, size).into_iter().enumerate() {
            let best = (0..117).filter(|&k| set[k].is_some()).map(|k| squared(i, k)).min();
            assert_eq!(found.map(|k| squared(i, k as usize)), best, "pixel {i}");
        }
    }
}
