//! The one machine instruction that portable Rust lacks here.
#![allow(unsafe_code)]

/// Ask the cache for the line that holds `slice[index]`; out of range is allowed and does nothing.
#[inline(always)]
pub(super) fn prefetch(slice: &[f32], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(value) = slice.get(index) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: the pointer comes from a live reference; prefetching neither reads nor writes memory.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, index);
}
