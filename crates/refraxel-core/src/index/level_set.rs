//! The surface of a body: the zero level of a cubic B-spline, theory (2.22), planes, or a spline that planes cut, (4.14).

use super::facets::Facets;
use super::hull::may_vanish;
use super::interpolation::Interpolation;
use super::lattice::Lattice;
use super::stencil::Stencil;
use super::vacuum::BORDER;
use super::{flat, prefilter};
use crate::{Aabb, Domain, Real, Vec3};

/// A body as φ < 0, theory (2.22): φ(x) = Σ_j c_j B_j(x) [scene unit], best a signed distance.
///
/// The coefficients c_j [scene unit] lie on `resolution` nodes from face to face of a box, x fastest. φ > 0 in the
/// outermost cells and outside: the coefficients of the border (3 layers) are no parameters and are kept at half a voxel or
/// more. A body that reaches them is cut off there.
///
/// φ is C², so normals and curvatures are continuous. [`Self::with_planes`] and [`Self::cut_by`] give it edges instead. Source: Osher & Fedkiw 2003 for the method; the spline is that of
/// theory (2.5).
///
/// ```
/// use refraxel_core::{Aabb, LevelSet, Vec3, vec3};
/// let cube = Aabb::cube(1.0);
/// let ball = LevelSet::from_samples(cube, [41; 3], |x: Vec3<f64>| x.length() - 0.6);
/// assert!(ball.is_inside(vec3(0.3, 0.3, 0.4)) && !ball.is_inside(vec3(0.4, 0.4, 0.4)));
/// // Interpolation is of fourth order: the surface lies within 1e-4 voxel of the sphere.
/// assert!(ball.value(vec3(0.36, 0.48, 0.0)).abs() < 5e-6);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LevelSet<T: Copy> {
    /// Marks the cells that may hold the zero level.
    lattice: Lattice<T>,
    coefficients: Vec<T>,
    /// Planes that take the place of the spline, or cut it.
    facets: Option<Facets<T>>,
}

/// Least coefficient of the border [voxel], which keeps the surface away from the faces of the box.
pub const BORDER_VALUE: f64 = 0.5;

/// A point closer to a surface than this [voxel] may stand on it: more than the rounding of φ in `f32`, and less than the
/// splines of two surfaces that should coincide differ.
pub const TOUCH: f64 = 1e-3;

/// Cells whose φ comes closer to 0 than this [voxel] are searched for crossings: covers the rounding of `f32`.
const MARGIN: f64 = 1e-4;

impl<T: Real> LevelSet<T> {
    /// The level set that takes the values `phi(x)` [scene unit] at its nodes, theory (2.8). Right for distances.
    ///
    /// Error of the surface: O(h⁴) where it is smooth; it rings beside creases.
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn from_samples(bounds: Aabb<T>, resolution: [u32; 3], phi: impl Fn(Vec3<T>) -> T) -> Self {
        let Self { lattice, coefficients, .. } = Self::unmarked(bounds, resolution, phi);
        Self::through(lattice, coefficients)
    }

    /// The level set that takes these values [scene unit] at the nodes of `lattice`, x fastest.
    pub(super) fn through(lattice: Lattice<T>, mut values: Vec<T>) -> Self {
        prefilter::interpolate_all(&mut values, lattice.nodes());
        let mut out = Self { lattice, coefficients: values, facets: None };
        out.find_surface();
        out
    }

    /// The level set whose coefficients are `phi(x)` [scene unit] at the nodes: φ is blurred (variance 1/3 voxel² per axis),
    /// which rounds steps and creases. A sphere of radius R [voxel] shrinks by 1/(3R) voxel.
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn from_control_values(bounds: Aabb<T>, resolution: [u32; 3], phi: impl Fn(Vec3<T>) -> T) -> Self {
        let mut out = Self::unmarked(bounds, resolution, phi);
        out.find_surface();
        out
    }

    /// The level set with these coefficients [scene unit], x fastest; `None` unless there is one per node, all finite.
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn from_coefficients(bounds: Aabb<T>, resolution: [u32; 3], coefficients: Vec<T>) -> Option<Self> {
        let lattice = Lattice::new(bounds, resolution);
        let is_valid = coefficients.len() == lattice.total() && coefficients.iter().all(|c| c.is_finite());
        is_valid.then(|| {
            let mut out = Self { lattice, coefficients, facets: None };
            out.find_surface();
            out
        })
    }

    /// The same body with flat faces and sharp edges: from now on φ(x) = max_k (n_k·x − o_k) in place of the spline, for planes
    /// of unit normals n_k [1], outwards, at distances o_k from the origin [scene unit]. The coefficients should be heights above the
    /// highest plane. Derivatives are by the planes then, not by the coefficients: see [`Self::scatter`].
    ///
    /// φ has a crease in each edge; its Hessian is 0. The body is cut off 2.5 voxels inside its box.
    #[must_use]
    pub fn with_planes(mut self, planes: impl IntoIterator<Item = (Vec3<T>, T)>) -> Self {
        self.facets = Some(Facets::enclosing(planes, &self.lattice));
        self
    }

    /// What of the body lies below planes of unit normals n_k [1], outwards, at distances o_k from the origin [scene unit], with
    /// sharp edges: φ(x) is the spline or max_k (n_k·x − o_k), whichever is larger. Best where the spline goes on beyond the planes, for some
    /// voxels at least. The planes are no parameters, and take the place of any before them.
    #[must_use]
    pub fn cut_by(mut self, planes: impl IntoIterator<Item = (Vec3<T>, T)>) -> Self {
        let planes = Facets::cutting(planes, &self.lattice);
        self.facets = Some(planes).filter(|f| !f.planes.is_empty());
        self
    }

    /// Other planes in place of those of [`Self::with_planes`], and their heights at the nodes [scene unit]. The cells of the spline's
    /// surface, of which planes make no use, are not found again.
    ///
    /// # Panics
    /// If there is not one height per node.
    pub fn move_planes(&mut self, heights: Vec<T>, planes: impl IntoIterator<Item = (Vec3<T>, T)>) {
        assert_eq!(heights.len(), self.lattice.total(), "one height per node");
        self.coefficients = heights;
        self.facets = Some(Facets::enclosing(planes, &self.lattice));
    }

    /// The level set with the coefficients `phi(x)`, before its surface is found.
    fn unmarked(bounds: Aabb<T>, resolution: [u32; 3], phi: impl Fn(Vec3<T>) -> T) -> Self {
        let lattice = Lattice::new(bounds, resolution);
        let coefficients = (0..lattice.total()).map(|j| phi(lattice.position(j))).collect();
        Self { lattice, coefficients, facets: None }
    }

    /// The same surface in another precision.
    pub fn cast<U: Real>(&self) -> LevelSet<U> {
        let mut out = LevelSet {
            lattice: self.lattice.cast(),
            coefficients: self.coefficients.iter().map(|c| U::of(c.f64())).collect(),
            facets: self.facets.as_ref().map(Facets::cast),
        };
        out.find_surface();
        out
    }

    /// The box and the number of nodes per axis.
    pub fn domain(&self) -> &Domain<T> {
        &self.lattice.domain
    }
    /// Edge length of a voxel [scene unit], the smallest of the three axes.
    pub fn voxel(&self) -> T {
        self.lattice.domain.voxel()
    }
    /// The coefficients of φ [scene unit], one per node, x fastest.
    pub fn coefficients(&self) -> &[T] {
        &self.coefficients
    }
    /// The coefficients, to be changed: the surface is that of the spline from now on, in place of planes that enclosed the body; those that
    /// cut it stay. Call [`Self::find_surface`] afterwards: until then rays look for the surface where it was.
    pub fn coefficients_mut(&mut self) -> &mut [T] {
        self.facets.take_if(|f| f.alone);
        &mut self.coefficients
    }

    /// φ + `by` [scene unit] on the same grid: the surface moves inwards to where this body is so deep, or outwards where `by` < 0.
    /// B-splines add up to 1: what is added to each coefficient is added to φ.
    #[must_use]
    pub fn raised(&self, by: T) -> Self {
        let mut raised = self.clone();
        raised.coefficients_mut().iter_mut().for_each(|c| *c += by);
        raised.find_surface();
        raised
    }

    /// Finds again which cells may hold the zero level: those where the control values of φ as a Bézier volume change sign,
    /// within 1e-4 voxel. Lifts the border to half a voxel. Costs about 40 ns per node.
    pub fn find_surface(&mut self) {
        let (n, voxel) = (self.lattice.nodes(), self.voxel());
        let least = T::of(BORDER_VALUE) * voxel;
        for (j, c) in self.coefficients.iter_mut().enumerate() {
            if *c < least && !self.lattice.is_inner(j) {
                *c = least;
            }
        }
        let (c, margin) = (&self.coefficients, T::of(MARGIN) * voxel);
        self.lattice.clearance = flat::distance_to(&may_vanish(c, n, margin), n);
    }

    /// The planes of the body, by (h, m): at node coordinates g their heights are h + m·g [scene unit]. Of a body that they enclose alone,
    /// those that cut it off inside its box are among them; none where it is a spline.
    pub fn planes(&self) -> &[(T, Vec3<T>)] {
        self.facets.as_ref().map_or(&[], |f| &f.planes)
    }
    /// Whether planes take the place of the spline.
    pub fn is_of_planes(&self) -> bool {
        self.facets.as_ref().is_some_and(|f| f.alone)
    }
    /// The planes that cut the spline, as long as they are taken away.
    pub(super) fn take_cuts(&mut self) -> Option<Facets<T>> {
        self.facets.take_if(|f| !f.alone)
    }
    /// They cut it again.
    pub(super) fn put_cuts(&mut self, cuts: Option<Facets<T>>) {
        if cuts.is_some() {
            self.facets = cuts;
        }
    }

    /// World position of a node [scene unit].
    pub fn position(&self, node: usize) -> Vec3<T> {
        self.lattice.position(node)
    }
    /// False for the nodes of the border, which stay outside the body.
    pub fn is_parameter(&self, node: usize) -> bool {
        self.lattice.is_inner(node)
    }
    /// The nodes that are parameters, in increasing order.
    pub fn parameters(&self) -> impl Iterator<Item = usize> + use<T> {
        self.lattice.inner(BORDER)
    }
    /// Distance in cells from the cell of `x` to the nearest that may hold the surface; `None` outside the box.
    pub fn clearance(&self, x: Vec3<T>) -> Option<u8> {
        self.lattice.clearance_at(self.lattice.node(x))
    }
    /// Per cell (n − 1 per axis, x fastest) the Chebyshev distance [cell] to the nearest one that may hold the surface, which is 0 for those.
    pub fn clearances(&self) -> &[u8] {
        &self.lattice.clearance
    }
    /// The lattice of nodes; its marked cells are those that may hold the surface.
    #[inline(always)]
    pub(crate) fn lattice(&self) -> &Lattice<T> {
        &self.lattice
    }

    /// The stencil at node coordinates `g`; `None` outside the box and in its outermost cells.
    #[inline(always)]
    fn stencil_at(&self, g: Vec3<T>) -> Option<Stencil<T>> {
        let cell = self.lattice.cell(g)?;
        if self.lattice.is_rim(cell) {
            return None;
        }
        let f = g - Vec3::from(cell.map(|c| T::of(c as f64)));
        let resolution = self.lattice.domain.resolution;
        Some(Stencil::new(Interpolation::CubicBSpline, resolution, cell, f))
    }
    /// The stencil at a world point.
    #[inline(always)]
    fn stencil(&self, x: Vec3<T>) -> Option<Stencil<T>> {
        self.stencil_at(self.lattice.node(x))
    }

    /// Where the line g + t v in node coordinates is below all planes, if there are some: between these two, or nowhere.
    #[inline(always)]
    pub(crate) fn below_planes(&self, g: Vec3<T>, v: Vec3<T>) -> Option<[T; 2]> {
        self.facets.as_ref().map(|f| f.inside(g, v))
    }

    /// φ [scene unit] and its gradient [scene unit / node] at node coordinates `g`; half a voxel outside the spline.
    #[inline(always)]
    pub(crate) fn sample_at(&self, g: Vec3<T>) -> (T, Vec3<T>) {
        match &self.facets {
            None => self.sample_spline_at(g),
            Some(facets) if facets.alone => facets.sample(g),
            Some(facets) => {
                let (spline, planes) = (self.sample_spline_at(g), facets.sample(g));
                if planes.0 > spline.0 { planes } else { spline }
            }
        }
    }
    /// The same of the spline, whatever planes there are.
    #[inline(always)]
    pub(crate) fn sample_spline_at(&self, g: Vec3<T>) -> (T, Vec3<T>) {
        match self.stencil_at(g) {
            Some(s) => s.value_and_force(&self.coefficients),
            None => (T::of(BORDER_VALUE) * self.voxel(), Vec3::zero()),
        }
    }
    /// The stencil where φ is the spline; `None` where it is a plane.
    fn stencil_of_spline(&self, x: Vec3<T>) -> Option<Stencil<T>> {
        let stencil = self.stencil(x)?;
        let is_spline = |f: &Facets<T>| {
            !f.alone && stencil.value_and_force(&self.coefficients).0 >= f.sample(self.lattice.node(x)).0
        };
        self.facets.as_ref().is_none_or(is_spline).then_some(stencil)
    }

    /// φ [scene unit]; half a voxel outside the spline.
    pub fn value(&self, x: Vec3<T>) -> T {
        self.sample(x).0
    }
    /// (φ [scene unit], ∇φ [1]) from one stencil. ∇φ points out of the body.
    pub fn sample(&self, x: Vec3<T>) -> (T, Vec3<T>) {
        let (value, gradient) = self.sample_at(self.lattice.node(x));
        (value, gradient.hadamard(self.lattice.scale))
    }
    /// True where φ < 0.
    pub fn is_inside(&self, x: Vec3<T>) -> bool {
        self.value(x) < T::zero()
    }
    /// Whether a ray of momentum `p` at `x` goes on inside the body: φ < 0, or φ falls along p where x stands on the surface.
    pub(crate) fn holds_ahead(&self, x: Vec3<T>, p: Vec3<T>) -> bool {
        let (phi, gradient) = self.sample(x);
        let stands_on = phi.abs() < T::of(TOUCH) * self.voxel();
        if stands_on { gradient.dot(p) < T::zero() } else { phi < T::zero() }
    }
    /// Hess(φ) v [1 / scene unit]: the transpose of the derivative of ∇φ by x, theory (2.28).
    pub fn hessian(&self, x: Vec3<T>, v: Vec3<T>) -> Vec3<T> {
        let Some(s) = self.stencil_of_spline(x) else { return Vec3::zero() };
        let scale = self.lattice.scale;
        s.force_pullback(&self.coefficients, v.hadamard(scale)).hadamard(scale)
    }
    /// Transpose of [`Self::sample`] with respect to the coefficients, theory (2.28) and (2.29): adds to `grad`, one per
    /// node. The border receives nothing.
    ///
    /// Of planes, `grad` begins with four numbers for each instead: dLoss/dn_k, the plane being turned about the middle c of the box, and
    /// dLoss/d(n_k·c − o_k). Where planes cut the spline, nothing is received.
    pub fn scatter(&self, x: Vec3<T>, d_value: T, d_gradient: Vec3<T>, grad: &mut [T]) {
        if let Some(facets) = self.facets.as_ref().filter(|f| f.alone) {
            let arm = x - self.lattice.domain.bounds.center();
            return facets.scatter(self.lattice.node(x), arm, d_value, d_gradient, grad);
        }
        if let Some(stencil) = self.stencil_of_spline(x) {
            let stencil = stencil.without_border(self.lattice.nodes());
            stencil.scatter(d_value, d_gradient.hadamard(self.lattice.scale), grad);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::index::tests::Sequence;
    use crate::vec3;

    /// A box with voxels of different edge lengths and random coefficients.
    fn rough(seed: u64) -> LevelSet<f64> {
        let (mut r, n) = (Sequence(seed), [13, 12, 11]);
        let bounds = Aabb::new(vec3(-1.0, -1.2, 0.3), vec3(1.0, 1.5, 2.0));
        LevelSet::from_coefficients(bounds, n, (0..13 * 12 * 11).map(|_| r.next()).collect()).unwrap()
    }

    fn points(level: &LevelSet<f64>, count: usize) -> Vec<Vec3<f64>> {
        let (b, mut r) = (level.domain().bounds, Sequence(17));
        (0..count).map(|_| b.center() + r.vector().hadamard(b.extent() * 0.49)).collect()
    }

    #[test]
    fn gradient_and_hessian_match_central_differences() {
        let (level, v, e) = (rough(3), vec3(0.3, -1.1, 0.7), 1e-5);
        for x in points(&level, 100) {
            let rim = level.lattice.is_rim(level.lattice.cell(level.lattice.node(x)).unwrap());
            let (gradient, hessian) = (level.sample(x).1, level.hessian(x, v));
            for a in (0..3).filter(|_| !rim) {
                let mut s = Vec3::zero();
                s[a] = e;
                let fd = (level.value(x + s) - level.value(x - s)) / (2.0 * e);
                assert!((fd - gradient[a]).abs() < 1e-7, "{fd} vs {}", gradient[a]);
                let fd = (level.sample(x + s).1 - level.sample(x - s).1).dot(v) / (2.0 * e);
                assert!((fd - hessian[a]).abs() < 1e-5, "{fd} vs {}", hessian[a]);
            }
        }
    }

    #[test]
    fn scatter_is_the_transpose_of_sampling_without_the_border() {
        let (level, mut r) = (rough(5), Sequence(1));
        let inner = |j: usize| level.is_parameter(j);
        let mut free = level.clone();
        (0..free.coefficients.len()).filter(|&j| !inner(j)).for_each(|j| free.coefficients[j] = 0.0);
        for x in points(&level, 60) {
            let (d_value, d_gradient) = (r.next(), r.vector());
            let mut grad = vec![0.0; level.coefficients().len()];
            level.scatter(x, d_value, d_gradient, &mut grad);
            let cell = free.lattice.cell(free.lattice.node(x)).unwrap();
            let (value, gradient) =
                if free.lattice.is_rim(cell) { (0.0, Vec3::zero()) } else { free.sample(x) };
            let forward = d_value * value + d_gradient.dot(gradient);
            let backward: f64 = grad.iter().zip(level.coefficients()).map(|(d, c)| d * c).sum();
            assert!((forward - backward).abs() < 1e-12, "{forward} vs {backward}");
            assert!((0..grad.len()).all(|j| inner(j) || grad[j] == 0.0));
        }
    }

    #[test]
    fn cells_without_surface_keep_their_sign_and_few_are_searched_in_vain() {
        let cube = Aabb::cube(1.0);
        let ball = LevelSet::from_samples(cube, [24; 3], |x: Vec3<f64>| x.length() - 0.6);
        let (mut searched, mut held) = (0, 0);
        for (i, clearance) in ball.lattice.clearance.iter().enumerate() {
            let corner = Vec3::from([i % 23, i / 23 % 23, i / (23 * 23)].map(|v| v as f64));
            let mut signs = [false; 2];
            for k in 0..512 {
                let inside = Vec3::from([k % 8, k / 8 % 8, k / 64].map(|v| f64::from(v) / 7.0));
                let x = ball.domain().bounds.min + (corner + inside) * ball.voxel();
                signs[usize::from(ball.is_inside(x))] = true;
            }
            let holds = signs == [true; 2];
            assert!(!holds || *clearance == 0);
            searched += usize::from(*clearance == 0);
            held += usize::from(holds);
        }
        assert!(searched < held * 11 / 10, "{searched} cells for {held}");
    }

    #[test]
    fn what_reaches_the_border_is_cut_off_inside_the_box() {
        let cube = Aabb::cube(1.0);
        let level = LevelSet::from_control_values(cube, [21; 3], |x: Vec3<f64>| x.z);
        assert!(level.is_inside(vec3(0.0, 0.0, -0.3)));
        for face in [vec3(1.0, 0.0, -0.5), vec3(0.3, 0.2, -1.0), vec3(-0.95, 0.0, -0.5), vec3(3.0, 0.0, 0.0)]
        {
            assert!(!level.is_inside(face));
        }
        assert!(LevelSet::from_coefficients(cube, [8; 3], vec![f64::NAN; 512]).is_none());
        assert!(LevelSet::from_coefficients(cube, [8; 3], vec![1.0; 511]).is_none());
    }
}
