//! Priors on the index, theory (2.20) and (2.21): most of a scene is air, and glass has one index.
//!
//! They act on n_j = √(2 c_j) at the nodes; for a B-spline these are the control values, between whose least and largest n
//! stays. Gradients are with respect to the coefficients c of w, by dn/dc = 1/n.

use super::IndexGrid;
use crate::Real;
use crate::priors::{charbonnier, charbonnier_slope, huber, huber_slope};

/// How a difference of indices is penalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Penalty<T> {
    /// √(d² + ε²) − ε. As variation: total variation, which flattens and keeps jumps.
    Charbonnier {
        /// Differences below this [of n] are treated as noise.
        epsilon: T,
    },
    /// d²/2. As variation: a membrane, which spreads jumps.
    Squared,
    /// d²/2 below δ, δ (|d| − δ/2) above.
    Huber {
        /// Where the parabola turns into a line [of n].
        delta: T,
    },
}

impl<T: Real> Penalty<T> {
    /// ψ(d) ≥ 0 of a difference d of indices [1].
    pub fn value(self, d: T) -> T {
        match self {
            Self::Charbonnier { epsilon } => charbonnier(d, epsilon),
            Self::Squared => T::of(0.5) * d * d,
            Self::Huber { delta } => huber(d, delta),
        }
    }
    /// ψ'(d), the derivative of [`Self::value`].
    pub fn slope(self, d: T) -> T {
        match self {
            Self::Charbonnier { epsilon } => charbonnier_slope(d, epsilon),
            Self::Squared => d,
            Self::Huber { delta } => huber_slope(d, delta),
        }
    }
}

/// Variation of n, theory (2.20): Σ ψ(n_i − n_j) over the edges (i, j) of the grid, divided by the number of parameters.
/// Summed in f64.
pub fn variation<T: Real>(grid: &IndexGrid<T>, penalty: Penalty<T>) -> f64 {
    let n = node_indices(grid);
    let sum: f64 = edges(grid).map(|(i, j)| penalty.value(n[j] - n[i]).f64()).sum();
    sum / grid.parameters().count() as f64
}

/// Adds `weight` times the gradient of [`variation`] by the coefficients of w to `grad`, one per node, x fastest. The border
/// receives nothing.
pub fn variation_vjp<T: Real>(grid: &IndexGrid<T>, penalty: Penalty<T>, weight: T, grad: &mut [T]) {
    let n = node_indices(grid);
    let scale = weight / T::of(grid.parameters().count() as f64);
    for (i, j) in edges(grid) {
        let slope = scale * penalty.slope(n[j] - n[i]);
        for (node, sign) in [(i, -T::one()), (j, T::one())] {
            if grid.is_parameter(node) {
                grad[node] += sign * slope / n[node];
            }
        }
    }
}

/// Deviation of n from `reference` (1 for air), theory (2.21): Σ ψ(n_j − reference) over the parameters, divided by their
/// number. Summed in f64.
pub fn deviation<T: Real>(grid: &IndexGrid<T>, reference: T, penalty: Penalty<T>) -> f64 {
    let n = node_indices(grid);
    let sum: f64 = grid.parameters().map(|j| penalty.value(n[j] - reference).f64()).sum();
    sum / grid.parameters().count() as f64
}

/// Adds `weight` times the gradient of [`deviation`] by the coefficients of w to `grad`, one per node, x fastest.
pub fn deviation_vjp<T: Real>(
    grid: &IndexGrid<T>,
    reference: T,
    penalty: Penalty<T>,
    weight: T,
    grad: &mut [T],
) {
    let n = node_indices(grid);
    let scale = weight / T::of(grid.parameters().count() as f64);
    for j in grid.parameters() {
        grad[j] += scale * penalty.slope(n[j] - reference) / n[j];
    }
}

/// n_j = √(2 c_j) of all nodes, x fastest.
fn node_indices<T: Real>(grid: &IndexGrid<T>) -> Vec<T> {
    grid.coefficients().iter().map(|&c| (c + c).sqrt()).collect()
}

/// Edges (node, next node along x, y or z) with at least one end that is a parameter: from each parameter forwards, and
/// backwards where the node before belongs to the border. Each edge comes once.
fn edges<T: Real>(grid: &IndexGrid<T>) -> impl Iterator<Item = (usize, usize)> + '_ {
    let n = grid.lattice().nodes();
    let strides = [1, n[0], n[0] * n[1]];
    grid.parameters().flat_map(move |j| {
        let at = grid.lattice().coordinates(j);
        (0..3).flat_map(move |a| {
            let s = strides[a];
            let before = (at[a] > 0 && !grid.is_parameter(j - s)).then(|| (j - s, j));
            (at[a] + 1 < n[a]).then_some((j, j + s)).into_iter().chain(before)
        })
    })
}
