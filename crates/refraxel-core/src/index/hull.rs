//! Which cells of a cubic spline may hold its zero level.
//!
//! In a cell a cubic B-spline is a polynomial, and can be written as a Bézier volume: it lies between the least and the
//! largest of its 4³ Bézier control values. Where these have one sign the cell holds no zero. The bound is tight: around a
//! ball, fewer than one cell in ten that passes this test holds no surface.

use super::flat::windows;
use super::stencil::TAPS;
use crate::Real;

/// Per cell (n − 1 per axis, x fastest): false where the cubic B-spline of the coefficients `c` (one per node, x fastest)
/// keeps its sign by `margin` [unit of c] for certain. Rim cells, whose stencil is incomplete, are false.
///
/// Most cells are decided by their 4³ coefficients, whose range contains that of the control values; only the others
/// need the control values.
pub(super) fn may_vanish<T: Real>(c: &[T], n: [usize; 3], margin: T) -> Vec<bool> {
    // Whether a coefficient may be on either side.
    let sides: Vec<u8> = c.iter().map(|c| u8::from(*c <= margin) | u8::from(*c >= -margin) << 1).collect();
    let mut out: Vec<bool> = windows(&sides, n, |a, b| a | b).into_iter().map(|sides| sides == 3).collect();
    let cells = n.map(|n| n - 1);
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let cell = x + cells[0] * (y + cells[1] * z);
                if out[cell] {
                    let is_rim = (0..3).any(|a| [x, y, z][a] == 0 || [x, y, z][a] + 1 == cells[a]);
                    out[cell] = !is_rim && changes_sign(c, n, [x, y, z], margin);
                }
            }
        }
    }
    out
}

/// True if the Bézier control values of a cell that is not at the rim reach from below `margin` to above −`margin`.
fn changes_sign<T: Real>(c: &[T], n: [usize; 3], cell: [usize; 3], margin: T) -> bool {
    // The conversion acts on one axis at a time: x, then y, then z.
    let base = cell[0] - 1 + n[0] * (cell[1] - 1 + n[1] * (cell[2] - 1));
    let mut b = [[[T::zero(); TAPS]; TAPS]; TAPS];
    for k in 0..TAPS {
        for j in 0..TAPS {
            b[k][j].copy_from_slice(&c[base + n[0] * (j + n[1] * k)..][..TAPS]);
            b[k][j] = bezier(b[k][j]);
        }
        let [r0, r1, r2, r3] = b[k];
        for i in 0..TAPS {
            let column = bezier([r0[i], r1[i], r2[i], r3[i]]);
            (0..TAPS).for_each(|j| b[k][j][i] = column[j]);
        }
    }
    let (mut low, mut high) = (T::infinity(), T::neg_infinity());
    for j in 0..TAPS {
        for i in 0..TAPS {
            for v in bezier([b[0][j][i], b[1][j][i], b[2][j][i], b[3][j][i]]) {
                low = low.min(v);
                high = high.max(v);
            }
        }
    }
    low <= margin && high >= -margin
}

/// The four Bézier control values of the middle cell of four B-spline coefficients. Source: Böhm 1981, knot insertion.
#[inline(always)]
fn bezier<T: Real>([a, b, c, d]: [T; TAPS]) -> [T; TAPS] {
    let (sixth, third, four) = (T::of(1.0 / 6.0), T::of(1.0 / 3.0), T::of(4.0));
    [sixth * (a + four * b + c), third * (b + b + c), third * (b + c + c), sixth * (b + four * c + d)]
}
