//! The one machine instruction that portable Rust lacks here.
#![allow(unsafe_code)]

/// Ask the cache for the line that holds `slice[index]`; an index out of range is allowed and useless.
#[inline(always)]
pub(super) fn prefetch<T>(slice: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: prefetching neither reads nor writes memory as far as the program can tell and never faults, whatever
        // the address; the address itself is formed by wrapping arithmetic.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(slice.as_ptr().wrapping_add(index).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, index);
}
