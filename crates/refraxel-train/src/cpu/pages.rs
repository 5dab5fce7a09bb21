//! Large pages for large arrays: rays read voxels all over the memory, and with pages of 4 KiB most reads look their page up.
#![allow(unsafe_code)]

/// Size of a large page [byte].
#[cfg(target_os = "linux")]
const LARGE: usize = 2 << 20;

/// Ask the system to hold an array in large pages, now and later. Where it cannot or will not, nothing changes.
pub(super) fn enlarge<T>(values: &[T]) {
    #[cfg(target_os = "linux")]
    {
        use std::ffi::{c_int, c_void};
        unsafe extern "C" {
            fn madvise(start: *mut c_void, bytes: usize, advice: c_int) -> c_int;
        }
        // MADV_HUGEPAGE and, from Linux 6.1 on, MADV_COLLAPSE.
        const ADVICE: [c_int; 2] = [14, 25];
        let range = values.as_ptr_range();
        let first = (range.start as usize).next_multiple_of(LARGE);
        let end = range.end as usize / LARGE * LARGE;
        if first < end {
            let start = range.start.wrapping_byte_add(first - range.start as usize);
            for advice in ADVICE {
                // SAFETY: the range lies within the array. Both kinds of advice change how the system holds it, never what it
                // contains, and a refusal changes nothing.
                unsafe { madvise(start.cast_mut().cast(), end - first, advice) };
            }
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = values;
}
