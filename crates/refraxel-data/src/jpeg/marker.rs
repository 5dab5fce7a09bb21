//! The markers between the segments of a JPEG.

/// The next marker and what follows it.
pub(super) fn next_marker(content: &[u8]) -> Option<(u8, &[u8])> {
    let at = content.windows(2).position(|w| w[0] == 0xff && !matches!(w[1], 0 | 0xff))?;
    Some((content[at + 1], &content[at + 2..]))
}
