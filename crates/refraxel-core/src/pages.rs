//! Large pages for large arrays: rays read voxels all over the memory, and with pages of 4 KiB most reads look their page up.
#![allow(unsafe_code)]

/// Size of a large page [byte].
#[cfg(target_os = "linux")]
const LARGE: usize = 2 << 20;
/// `MADV_HUGEPAGE`: pages that are not there yet come as large ones.
const EXPECTED: i32 = 14;
/// `MADV_COLLAPSE`, from Linux 6.1 on: small pages that are there are copied into large ones.
const COPIED: i32 = 25;

/// Asks the system for large pages where an array is written for the first time. Where it cannot or will not, nothing changes.
pub(crate) fn expect<T>(values: &[T]) {
    advise(values, EXPECTED);
}

/// Asks the system to move what is there already into large pages.
pub(crate) fn enlarge<T>(values: &[T]) {
    advise(values, COPIED);
}

#[cfg(target_os = "linux")]
fn advise<T>(values: &[T], advice: i32) {
    use std::ffi::{c_int, c_void};
    unsafe extern "C" {
        fn madvise(start: *mut c_void, bytes: usize, advice: c_int) -> c_int;
    }
    let range = values.as_ptr_range();
    let first = (range.start as usize).next_multiple_of(LARGE);
    let end = range.end as usize / LARGE * LARGE;
    if first < end {
        let start = range.start.wrapping_byte_add(first - range.start as usize);
        // SAFETY: the range lies within the array. Both kinds of advice change how the system holds it, never what it contains, and
        // a refusal changes nothing.
        unsafe { madvise(start.cast_mut().cast(), end - first, advice) };
    }
}

#[cfg(not(target_os = "linux"))]
fn advise<T>(_: &[T], _: i32) {}
