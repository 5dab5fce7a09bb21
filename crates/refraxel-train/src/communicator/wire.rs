//! Messages as 32-bit words: what is written in an order is read in the same order, bit for bit.

use refraxel_core::grid::Cell;
use refraxel_core::index::priors::Penalty;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Ray, Vec3};

/// What can travel.
pub(crate) trait Wire: Sized {
    /// Appends it to a message.
    fn put(&self, to: &mut Vec<u32>);
    /// Reads it from the front of a message.
    fn take(from: &mut Words) -> Self;
}

/// The rest of a message.
pub(crate) struct Words<'a>(pub &'a [u32]);

impl<'a> Words<'a> {
    /// The next words.
    ///
    /// # Panics
    /// If there are fewer: messages come whole, and from the same program.
    pub fn next(&mut self, count: usize) -> &'a [u32] {
        let (next, rest) = self.0.split_at(count);
        self.0 = rest;
        next
    }
}

impl Wire for u32 {
    fn put(&self, to: &mut Vec<u32>) {
        to.push(*self);
    }
    fn take(from: &mut Words) -> Self {
        from.next(1)[0]
    }
}

impl Wire for u64 {
    fn put(&self, to: &mut Vec<u32>) {
        to.extend([*self as u32, (*self >> 32) as u32]);
    }
    fn take(from: &mut Words) -> Self {
        let words = from.next(2);
        u64::from(words[0]) | u64::from(words[1]) << 32
    }
}

/// What travels as something else.
macro_rules! as_other {
    ($($type:ty as $other:ty: $to:expr, $back:expr;)*) => {$(
        impl Wire for $type {
            fn put(&self, to: &mut Vec<u32>) {
                let to_other: fn($type) -> $other = $to;
                to_other(*self).put(to);
            }
            fn take(from: &mut Words) -> Self {
                let back: fn($other) -> $type = $back;
                back(<$other>::take(from))
            }
        }
    )*};
}

as_other! {
    u16 as u32: u32::from, |word| word as u16;
    bool as u32: u32::from, |word| word != 0;
    usize as u64: |n| n as u64, |n| n as usize;
    f32 as u32: f32::to_bits, f32::from_bits;
    f64 as u64: f64::to_bits, f64::from_bits;
}

impl<T: Wire, const N: usize> Wire for [T; N] {
    fn put(&self, to: &mut Vec<u32>) {
        self.iter().for_each(|x| x.put(to));
    }
    fn take(from: &mut Words) -> Self {
        std::array::from_fn(|_| T::take(from))
    }
}

impl<T: Wire> Wire for Vec<T> {
    fn put(&self, to: &mut Vec<u32>) {
        put_all(self, to);
    }
    fn take(from: &mut Words) -> Self {
        let count = usize::take(from);
        (0..count).map(|_| T::take(from)).collect()
    }
}

/// Appends what [`Vec`] reads.
pub(crate) fn put_all<T: Wire>(all: &[T], to: &mut Vec<u32>) {
    all.len().put(to);
    all.iter().for_each(|x| x.put(to));
}

impl<T: Wire> Wire for Option<T> {
    fn put(&self, to: &mut Vec<u32>) {
        self.is_some().put(to);
        self.iter().for_each(|x| x.put(to));
    }
    fn take(from: &mut Words) -> Self {
        bool::take(from).then(|| T::take(from))
    }
}

impl<A: Wire, B: Wire> Wire for (A, B) {
    fn put(&self, to: &mut Vec<u32>) {
        self.0.put(to);
        self.1.put(to);
    }
    fn take(from: &mut Words) -> Self {
        (A::take(from), B::take(from))
    }
}

/// Structures travel field by field.
macro_rules! wire {
    ($($type:ty { $($field:ident),* $(,)? })*) => {$(
        impl $crate::communicator::wire::Wire for $type {
            fn put(&self, to: &mut Vec<u32>) {
                $($crate::communicator::wire::Wire::put(&self.$field, to);)*
            }
            fn take(from: &mut $crate::communicator::wire::Words) -> Self {
                Self { $($field: $crate::communicator::wire::Wire::take(from)),* }
            }
        }
    )*};
}
pub(crate) use wire;

wire! {
    Vec3<f32> { x, y, z }
    Ray<f32> { origin, direction }
    Cell { slot, local }
    Pixel<f32> { colour, transmittance, depth }
}

impl Wire for Penalty<f32> {
    fn put(&self, to: &mut Vec<u32>) {
        let (kind, number) = match self {
            Self::Charbonnier { epsilon } => (0_u32, *epsilon),
            Self::Squared => (1, 0.0),
            Self::Huber { delta } => (2, *delta),
        };
        (kind, number).put(to);
    }
    fn take(from: &mut Words) -> Self {
        match <(u32, f32)>::take(from) {
            (0, epsilon) => Self::Charbonnier { epsilon },
            (1, _) => Self::Squared,
            (_, delta) => Self::Huber { delta },
        }
    }
}

/// Appends bytes; [`take_bytes`] reads them.
pub(crate) fn put_bytes(bytes: &[u8], to: &mut Vec<u32>) {
    bytes.len().put(to);
    let word = |four: &[u8]| u32::from_le_bytes(std::array::from_fn(|k| four.get(k).copied().unwrap_or(0)));
    to.extend(bytes.chunks(4).map(word));
}

/// The next bytes.
pub(crate) fn take_bytes(from: &mut Words) -> Vec<u8> {
    let count = usize::take(from);
    let mut bytes: Vec<u8> = from.next(count.div_ceil(4)).iter().flat_map(|w| w.to_le_bytes()).collect();
    bytes.truncate(count);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Debug;

    fn there_and_back<T: Wire + PartialEq + Debug>(x: T) {
        let mut message = Vec::new();
        x.put(&mut message);
        7_u32.put(&mut message);
        let mut words = Words(&message);
        assert_eq!(T::take(&mut words), x);
        assert_eq!(words.0, [7]);
    }

    #[test]
    fn what_travels_arrives_as_it_was() {
        there_and_back(u64::MAX - 5);
        there_and_back(f32::NEG_INFINITY);
        there_and_back([-0.1_f64, f64::MIN_POSITIVE]);
        there_and_back(vec![(3_u16, true), (u16::MAX, false)]);
        there_and_back(vec![Some(Vec3 { x: 1.0_f32, y: -2.5, z: 1e-40 }), None]);
        there_and_back(vec![
            Penalty::Charbonnier { epsilon: 0.1 },
            Penalty::Squared,
            Penalty::Huber { delta: 3.0 },
        ]);
    }

    #[test]
    fn bytes_of_any_number_arrive() {
        for n in 0..9_u8 {
            let (bytes, mut message): (Vec<u8>, _) = ((0..n).collect(), Vec::new());
            put_bytes(&bytes, &mut message);
            assert_eq!(take_bytes(&mut Words(&message)), bytes);
        }
    }
}
