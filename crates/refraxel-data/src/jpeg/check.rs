//! The check of a file: its segments, and the number of codes in its scans.

use super::huffman::{Bits, Broken, Table};
use super::marker::next_marker;

/// Why pixels of a JPEG are missing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JpegFault {
    /// The file ends inside of a header.
    #[error("its headers are cut off or contradict themselves")]
    Headers,
    /// The codes end early.
    #[error("it breaks off after {shown:.0} % of the picture")]
    Cut {
        /// How much of the picture there is [percent].
        shown: f64,
    },
    /// The codes are not those of a picture.
    #[error("its codes make no sense after {shown:.0} % of the picture")]
    Garbled {
        /// Where that is noticed [percent].
        shown: f64,
    },
    /// There are more codes than the picture has blocks.
    #[error("it holds more codes than its picture has room for: a part is overwritten")]
    Surplus,
}

/// How every JPEG begins.
const START: [u8; 2] = [0xff, 0xd8];
/// Bytes that may follow the last code of a scan: encoders pad.
const PADDING: usize = 8;

/// What frame and tables say of the scans that follow.
#[derive(Default)]
struct Reader {
    frame: Option<Frame>,
    /// Tables of differences and of coefficients, by number.
    tables: [[Option<Table>; 4]; 2],
    /// Units between two restart markers; 0: there are none.
    restart: usize,
}

struct Frame {
    size: [usize; 2],
    components: Vec<Component>,
    is_sequential: bool,
}

#[derive(Clone, Copy)]
struct Component {
    id: u8,
    /// Blocks of a unit along x and y.
    blocks: [usize; 2],
    is_complete: bool,
}

/// Refuses a JPEG that lacks pixels. Other files, and kinds of JPEG that nobody decodes, pass.
pub(crate) fn check(content: &[u8]) -> Result<(), JpegFault> {
    let Some(mut rest) = content.strip_prefix(&START) else { return Ok(()) };
    let mut reader = Reader::default();
    while let Some((marker, after)) = next_marker(rest) {
        if marker == 0xd9 {
            return reader.end();
        }
        if matches!(marker, 0x01 | 0xd0..=0xd8) {
            rest = after;
            continue;
        }
        let length = after.first_chunk().map(|l| usize::from(u16::from_be_bytes(*l)));
        let segment = length.and_then(|l| after.get(2..l)).ok_or(JpegFault::Headers)?;
        rest = &after[segment.len() + 2..];
        match marker {
            0xc4 => reader.read_tables(segment)?,
            0xc0..=0xc2 => {
                reader.frame = Some(Frame::read(segment, marker != 0xc2).ok_or(JpegFault::Headers)?)
            }
            0xc3 | 0xc5..=0xcf => return Ok(()), // the decoder says that it knows no such kind
            0xdd => {
                let units = segment.first_chunk().ok_or(JpegFault::Headers)?;
                reader.restart = usize::from(u16::from_be_bytes(*units));
            }
            0xda => rest = reader.read_scan(segment, rest)?,
            _ => {}
        }
    }
    // Some cameras leave out the marker of the end.
    if reader.frame.as_ref().is_some_and(|f| f.is_sequential) {
        reader.end()
    } else {
        Err(JpegFault::Cut { shown: 0.0 })
    }
}

impl Reader {
    fn read_tables(&mut self, mut segment: &[u8]) -> Result<(), JpegFault> {
        while let Some((&place, content)) = segment.split_first() {
            let (table, rest) = Table::read(content).ok_or(JpegFault::Headers)?;
            let slot =
                self.tables.get_mut(usize::from(place >> 4)).and_then(|t| t.get_mut(usize::from(place & 15)));
            *slot.ok_or(JpegFault::Headers)? = Some(table);
            segment = rest;
        }
        Ok(())
    }

    /// Reads the codes of a scan; what follows them.
    fn read_scan<'a>(&mut self, segment: &[u8], codes: &'a [u8]) -> Result<&'a [u8], JpegFault> {
        let frame = self.frame.as_mut().ok_or(JpegFault::Headers)?;
        if !frame.is_sequential {
            return Ok(codes);
        }
        let (&count, listed) = segment.split_first().ok_or(JpegFault::Headers)?;
        let listed = listed.get(..2 * usize::from(count)).ok_or(JpegFault::Headers)?;
        let mut unit = Vec::new();
        for entry in listed.chunks_exact(2) {
            let c = frame.components.iter().position(|c| c.id == entry[0]).ok_or(JpegFault::Headers)?;
            let table = |kind: usize, number: u8| self.tables[kind].get(usize::from(number))?.as_ref();
            let (Some(dc), Some(ac)) = (table(0, entry[1] >> 4), table(1, entry[1] & 15)) else {
                return Ok(codes); // tables that everybody knows may be left out
            };
            let blocks = if count == 1 { 1 } else { frame.components[c].blocks.iter().product() };
            unit.extend(std::iter::repeat_n((dc, ac), blocks));
            frame.components[c].is_complete = true;
        }
        let first =
            frame.components.iter().find(|c| listed.first() == Some(&c.id)).ok_or(JpegFault::Headers)?;
        let units = frame.units(if count == 1 { Some(first.blocks) } else { None });
        let mut bits = Bits::new(codes);
        for done in 0..units {
            let shown = 100.0 * done as f64 / units as f64;
            if self.restart > 0 && done > 0 && done % self.restart == 0 && !bits.restart(PADDING) {
                return Err(JpegFault::Garbled { shown });
            }
            for (dc, ac) in &unit {
                bits.block(dc, ac).map_err(|broken| match broken {
                    Broken::End => JpegFault::Cut { shown },
                    Broken::Code => JpegFault::Garbled { shown },
                })?;
            }
        }
        if bits.left() > PADDING { Err(JpegFault::Surplus) } else { Ok(bits.rest()) }
    }

    fn end(&self) -> Result<(), JpegFault> {
        let frame = self.frame.as_ref().ok_or(JpegFault::Headers)?;
        let is_complete = !frame.is_sequential || frame.components.iter().all(|c| c.is_complete);
        if is_complete { Ok(()) } else { Err(JpegFault::Cut { shown: 0.0 }) }
    }
}

impl Frame {
    fn read(segment: &[u8], is_sequential: bool) -> Option<Self> {
        let &[_, h1, h0, w1, w0, count, ref listed @ ..] = segment else { return None };
        let size = [[w1, w0], [h1, h0]].map(|s| usize::from(u16::from_be_bytes(s)));
        let component = |c: &[u8]| {
            let blocks = [c[1] >> 4, c[1] & 15].map(usize::from);
            Component { id: c[0], blocks, is_complete: false }
        };
        let listed = listed.get(..3 * usize::from(count))?;
        let components: Vec<Component> = listed.chunks_exact(3).map(component).collect();
        let is_valid = components.iter().all(|c| c.blocks.iter().all(|b| (1..=4).contains(b)));
        (is_valid && !components.is_empty()).then_some(Self { size, components, is_sequential })
    }

    /// Units of a scan: of one component alone its blocks, else those of all components together.
    fn units(&self, alone: Option<[usize; 2]>) -> usize {
        let along = |a: usize| {
            let most = self.components.iter().map(|c| c.blocks[a]).max().unwrap_or(1);
            match alone {
                Some(blocks) => (self.size[a] * blocks[a]).div_ceil(most).div_ceil(8),
                None => self.size[a].div_ceil(8 * most),
            }
        };
        along(0) * along(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::codecs::jpeg::JpegEncoder;
    use ::image::{Rgb, RgbImage};

    /// A picture with detail everywhere.
    fn jpeg(width: u32, height: u32) -> Vec<u8> {
        let pixel = |x: u32, y: u32| Rgb([(x * 31 + y * 7) as u8, (x * x + y) as u8, (x ^ (y * 5)) as u8]);
        let mut out = Vec::new();
        RgbImage::from_fn(width, height, pixel)
            .write_with_encoder(JpegEncoder::new_with_quality(&mut out, 85))
            .unwrap();
        out
    }

    #[test]
    fn whole_pictures_of_any_size_pass_with_and_without_the_marker_of_the_end() {
        for (width, height) in [(1, 1), (8, 8), (17, 33), (120, 75)] {
            let whole = jpeg(width, height);
            assert_eq!(check(&whole), Ok(()), "{width}x{height}");
            assert_eq!(check(&whole[..whole.len() - 2]), Ok(()), "{width}x{height}");
            assert_eq!(check(&[&whole[..], b"a preview behind it"].concat()), Ok(()));
        }
        assert_eq!(check(b"\x89PNG"), Ok(()), "other files are not looked at");
    }

    #[test]
    fn a_picture_that_is_cut_anywhere_is_refused() {
        let whole = jpeg(120, 75);
        for cut in (2..whole.len() - 8).step_by(7) {
            assert!(check(&whole[..cut]).is_err(), "{cut} of {}", whole.len());
        }
        let half = check(&whole[..whole.len() / 2]).unwrap_err();
        assert!(matches!(half, JpegFault::Cut { shown } if (20.0..70.0).contains(&shown)), "{half:?}");
    }

    #[test]
    fn a_picture_that_is_overwritten_in_the_middle_is_refused() {
        let whole = jpeg(120, 75);
        let garbage = |i: usize| ((i * 7919) >> 3) as u8;
        for fill in [|_| 0, |_| 0xff, garbage as fn(usize) -> u8, |_| b' '] {
            for start in (whole.len() / 4..whole.len() / 2).step_by(61) {
                let mut damaged = whole.clone();
                (start..start + 300).for_each(|i| damaged[i] = fill(i));
                assert!(check(&damaged).is_err(), "{} at {start}", fill(1));
            }
        }
    }

    proptest::proptest! {
        #[test]
        fn damaged_pictures_never_panic(at in 0_usize..2000, byte: u8, cut in 2_usize..4000) {
            let mut damaged = jpeg(40, 30);
            let at = at % damaged.len();
            damaged[at] = byte;
            damaged.truncate(cut);
            let _ = check(&damaged);
        }
    }
}
