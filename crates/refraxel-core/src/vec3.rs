//! Three-vectors and 3×3 matrices over a [`Real`].
//!
//! Transforms act from the left on column vectors and read right to left: `world_from_camera * p_camera`.

use crate::Real;
use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

/// A vector of three components: a position [scene unit], a direction or momentum [1], or the adjoint of one of these.
///
/// Operators act component by component; products of two vectors have names ([`Vec3::dot`], [`Vec3::cross`],
/// [`Vec3::hadamard`]), so that none is mistaken for another. Indexing by 0, 1, 2 gives x, y, z and panics beyond.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec3<T> {
    /// First component.
    pub x: T,
    /// Second component.
    pub y: T,
    /// Third component.
    pub z: T,
}

/// Shorthand for [`Vec3::new`].
#[inline(always)]
pub const fn vec3<T>(x: T, y: T, z: T) -> Vec3<T> {
    Vec3 { x, y, z }
}

impl<T: Real> Vec3<T> {
    /// The vector (x, y, z).
    #[inline(always)]
    pub const fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }
    /// The vector (v, v, v).
    #[inline(always)]
    pub fn splat(v: T) -> Self {
        Self { x: v, y: v, z: v }
    }
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat(T::zero())
    }
    /// Inner product a · b, summed in the order x, y, z.
    #[inline(always)]
    pub fn dot(self, o: Self) -> T {
        self.x * o.x + self.y * o.y + self.z * o.z
    }
    /// Cross product a × b, right-handed: x × y = z.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        vec3(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }
    /// Euclidean length |a|.
    #[inline(always)]
    pub fn length(self) -> T {
        self.dot(self).sqrt()
    }
    /// The unit vector along `self`; undefined (NaN) for the zero vector.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        self * self.length().recip()
    }
    /// The vector (f(x), f(y), f(z)).
    #[inline(always)]
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Vec3<U> {
        vec3(f(self.x), f(self.y), f(self.z))
    }
    /// The vector of f(a, b) for the components a of `self` and b of `o`.
    #[inline(always)]
    pub fn zip(self, o: Self, f: impl Fn(T, T) -> T) -> Self {
        vec3(f(self.x, o.x), f(self.y, o.y), f(self.z, o.z))
    }
    /// Component-wise minimum; a NaN in one of the vectors is dropped.
    #[inline(always)]
    pub fn min(self, o: Self) -> Self {
        self.zip(o, T::min)
    }
    /// Component-wise maximum; a NaN in one of the vectors is dropped.
    #[inline(always)]
    pub fn max(self, o: Self) -> Self {
        self.zip(o, T::max)
    }
    /// Component-wise product a ⊙ b, for example with nodes per scene unit along each axis.
    #[inline(always)]
    pub fn hadamard(self, o: Self) -> Self {
        self.zip(o, |a, b| a * b)
    }
    /// Largest component.
    #[inline(always)]
    pub fn max_element(self) -> T {
        self.x.max(self.y).max(self.z)
    }
    /// Smallest component.
    #[inline(always)]
    pub fn min_element(self) -> T {
        self.x.min(self.y).min(self.z)
    }
    /// True when no component is NaN or infinite.
    #[inline(always)]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
    }
    /// The same vector in another precision, rounded to nearest.
    #[inline(always)]
    pub fn cast<U: Real>(self) -> Vec3<U> {
        self.map(|v| U::of(v.f64()))
    }
    /// As an array [x, y, z].
    #[inline(always)]
    pub fn to_array(self) -> [T; 3] {
        [self.x, self.y, self.z]
    }
}

impl<T> From<[T; 3]> for Vec3<T> {
    #[inline(always)]
    fn from([x, y, z]: [T; 3]) -> Self {
        Vec3 { x, y, z }
    }
}

/// Implements an operator of two vectors and its assigning form, component by component.
macro_rules! componentwise {
    ($op:ident, $f:ident, $assign:ident, $fa:ident) => {
        impl<T: Real> $op for Vec3<T> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, o: Self) -> Self {
                vec3(self.x.$f(o.x), self.y.$f(o.y), self.z.$f(o.z))
            }
        }
        impl<T: Real> $assign for Vec3<T> {
            #[inline(always)]
            fn $fa(&mut self, o: Self) {
                *self = $op::$f(*self, o);
            }
        }
    };
}
componentwise!(Add, add, AddAssign, add_assign);
componentwise!(Sub, sub, SubAssign, sub_assign);

impl<T: Real> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: T) -> Self {
        vec3(self.x * s, self.y * s, self.z * s)
    }
}
impl<T: Real> MulAssign<T> for Vec3<T> {
    #[inline(always)]
    fn mul_assign(&mut self, s: T) {
        *self = *self * s;
    }
}
impl<T: Real> Div<T> for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, s: T) -> Self {
        vec3(self.x / s, self.y / s, self.z / s)
    }
}
impl<T: Real> Neg for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        vec3(-self.x, -self.y, -self.z)
    }
}
impl<T> Index<usize> for Vec3<T> {
    type Output = T;
    #[inline(always)]
    fn index(&self, axis: usize) -> &T {
        [&self.x, &self.y, &self.z][axis]
    }
}
impl<T> IndexMut<usize> for Vec3<T> {
    #[inline(always)]
    fn index_mut(&mut self, axis: usize) -> &mut T {
        [&mut self.x, &mut self.y, &mut self.z][axis]
    }
}

/// A 3×3 matrix stored by its columns: a rotation maps the axis e_c of one frame to `columns[c]` in the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<T> {
    /// Columns, left to right.
    pub columns: [Vec3<T>; 3],
}

impl<T: Real> Mat3<T> {
    /// The identity.
    pub fn identity() -> Self {
        Self::from_rows([
            [T::one(), T::zero(), T::zero()],
            [T::zero(), T::one(), T::zero()],
            [T::zero(), T::zero(), T::one()],
        ])
    }
    /// The matrix with these rows, top to bottom, as a matrix is written on paper.
    pub fn from_rows(r: [[T; 3]; 3]) -> Self {
        Self { columns: [0, 1, 2].map(|c| vec3(r[0][c], r[1][c], r[2][c])) }
    }
    /// The rotation about an axis by an angle [rad], both given by the axis times the angle (Rodrigues).
    pub fn turning(by: Vec3<T>) -> Self {
        let angle = by.length();
        if angle == T::zero() {
            return Self::identity();
        }
        let axis = by * (T::one() / angle);
        let (sin, cos) = (angle.sin(), angle.cos());
        let turned = |v: Vec3<T>| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (T::one() - cos));
        Self { columns: Self::identity().columns.map(turned) }
    }
    /// The three rows, top to bottom.
    pub fn rows(&self) -> [[T; 3]; 3] {
        [0, 1, 2].map(|r| [0, 1, 2].map(|c| self.columns[c][r]))
    }
    /// The transpose, which is the inverse of a rotation.
    pub fn transpose(&self) -> Self {
        Self::from_rows(self.columns.map(Vec3::to_array))
    }
    /// Determinant: +1 for a rotation, −1 for a reflection.
    pub fn determinant(&self) -> T {
        self.columns[0].dot(self.columns[1].cross(self.columns[2]))
    }
}

impl<T: Real> Mul<Vec3<T>> for Mat3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        self.columns[0] * v.x + self.columns[1] * v.y + self.columns[2] * v.z
    }
}

impl<T: Real> Mul for Mat3<T> {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { columns: o.columns.map(|c| self * c) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transpose_moves_the_matrix_across_the_inner_product() {
        let a = Mat3::from_rows([[1.0, 2.0, 3.0], [-4.0, 0.5, 2.0], [0.0, 7.0, -1.0]]);
        let (u, v) = (vec3(0.3_f64, -2.0, 1.5), vec3(4.0, 0.1, -0.7));
        assert!(((a * u).dot(v) - u.dot(a.transpose() * v)).abs() < 1e-12);
        assert_eq!((a * Mat3::identity()).rows(), a.rows());
    }

    #[test]
    fn a_turn_follows_its_axis() {
        let quarter = Mat3::turning(vec3(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        assert!((quarter * vec3(1.0, 0.0, 0.5) - vec3(0.0, 1.0, 0.5)).length() < 1e-15);
        let by: Vec3<f64> = vec3(0.3, -0.2, 0.5);
        let there_and_back = Mat3::turning(by) * Mat3::turning(-by);
        assert!((there_and_back.columns[1] - vec3(0.0, 1.0, 0.0)).length() < 1e-15);
        assert!((Mat3::turning(by).determinant() - 1.0).abs() < 1e-15);
        assert_eq!(Mat3::turning(Vec3::<f64>::zero()).rows(), Mat3::identity().rows());
    }

    #[test]
    fn cross_product_is_right_handed() {
        assert_eq!(vec3(1.0, 0.0, 0.0).cross(vec3(0.0, 1.0, 0.0)), vec3(0.0, 0.0, 1.0));
    }
}
