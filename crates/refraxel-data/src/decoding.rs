//! Files of pictures to pixels as they are stored, and what files say of themselves before they are decoded.

use crate::extensions::conversion;
use crate::room::Room;
use crate::size::Size;
use crate::{DataError, jpeg, limits, profile};
use ::image::metadata::Orientation as Turn;
use ::image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, guess_format};
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek};
use std::path::Path;

/// What an image file says about itself before it is decoded.
#[derive(Clone, Debug)]
pub(crate) struct Header {
    /// Size of the stored pixels.
    pub stored: Size,
    /// What the camera's orientation tag (EXIF) asks for.
    pub orientation: Turn,
    /// The file has an alpha channel.
    pub alpha: bool,
    /// It is no picture in shades of grey.
    pub coloured: bool,
    /// The name of its colour profile, if that is not sRGB.
    pub profile: Option<String>,
}

impl Header {
    fn of(decoder: &mut dyn ImageDecoder) -> Self {
        let (width, height) = decoder.dimensions();
        // A damaged tag is no reason to refuse the pixels.
        let orientation = decoder.orientation().unwrap_or(Turn::NoTransforms);
        let icc = decoder.icc_profile().ok().flatten();
        Self {
            stored: Size { width, height },
            orientation,
            alpha: decoder.color_type().has_alpha(),
            coloured: decoder.color_type().has_color(),
            profile: icc.and_then(|icc| profile::other_than_srgb(&icc)),
        }
    }

    /// The tag asks for a rotation or reflection.
    pub fn turned(&self) -> bool {
        self.orientation != Turn::NoTransforms
    }

    /// Size after the tag is obeyed.
    pub fn upright(&self) -> Size {
        turned(self.stored, self.orientation)
    }
}

/// The size of a picture of this size that is turned.
pub(crate) fn turned(size: Size, turn: Turn) -> Size {
    use Turn::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    match turn {
        Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH => {
            Size { width: size.height, height: size.width }
        }
        _ => size,
    }
}

/// A decoded file.
pub(crate) struct Decoded {
    pub header: Header,
    /// The pixels as they are stored.
    pub image: DynamicImage,
    /// Taken as long as all pixels are there.
    pub room: Room,
}

/// Reads what a file says of itself without decoding it.
pub(crate) fn header(path: &Path) -> Result<Header, DataError> {
    open(path).map(|mut decoder| Header::of(&mut *decoder))
}

/// The file's decoder, checked against the limits.
pub(crate) fn open(path: &Path) -> Result<Box<dyn ImageDecoder>, DataError> {
    let mut start = Vec::new();
    let mut file = BufReader::new(limits::open_regular(path).map_err(unreadable(path))?);
    file.by_ref().take(START).read_to_end(&mut start).map_err(unreadable(path))?;
    file.rewind().map_err(unreadable(path))?;
    decoder(path, &start, Box::new(file))
}

/// Decodes a file. There is room for few large pictures at once.
pub(crate) fn decode(path: &Path) -> Result<Decoded, DataError> {
    let content = limits::read(path, limits::BINARY_BYTES)?;
    let mut decoder = decoder(path, &content, Box::new(Cursor::new(&content[..])))?;
    jpeg::check(&content).map_err(|fault| DataError::Jpeg { path: path.to_owned(), fault })?;
    let header = Header::of(&mut *decoder);
    let is_deep = decoder.color_type().bytes_per_pixel() > decoder.color_type().channel_count();
    // More than 8 bits become 32.
    let room = Room::take(decoder.total_bytes() * if is_deep { 3 } else { 1 });
    let image = DynamicImage::from_decoder(decoder).map_err(broken(path))?;
    Ok(Decoded { header, image, room })
}

/// So many bytes tell what a file is.
const START: u64 = 64;

fn unreadable(path: &Path) -> impl FnOnce(io::Error) -> DataError {
    let path = path.to_owned();
    move |source| DataError::Read { path, source }
}

fn broken(path: &Path) -> impl FnOnce(ImageError) -> DataError {
    let path = path.to_owned();
    move |source| DataError::Decode { path, source }
}

/// Where the bytes of a picture come from. One type for all: each reader that decoders are made for compiles every one of them anew.
trait Bytes: BufRead + Seek {}
impl<R: BufRead + Seek> Bytes for R {}

/// The decoder of what is read from the file at `path`, which begins so.
fn decoder<'a>(
    path: &Path,
    start: &[u8],
    bytes: Box<dyn Bytes + 'a>,
) -> Result<Box<dyn ImageDecoder + 'a>, DataError> {
    refuse_unread(path, start)?;
    let mut reader = ImageReader::new(bytes);
    if let Ok(format) = ImageFormat::from_path(path) {
        reader.set_format(format); // what the content does not show
    }
    let mut reader = reader.with_guessed_format().map_err(unreadable(path))?;
    let mut allowed = Limits::default();
    allowed.max_alloc = Some(limits::IMAGE_BYTES + (64 << 20)); // the decoder's own tables
    reader.limits(allowed);
    let decoder = reader.into_decoder().map_err(broken(path))?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    for (what, found, limit) in [
        ("the image size [pixels]", pixels, limits::IMAGE_PIXELS),
        ("the size of its pixels [bytes]", decoder.total_bytes(), limits::IMAGE_BYTES),
    ] {
        if found > limit {
            return Err(DataError::TooLarge { path: path.to_owned(), what, found, limit });
        }
    }
    Ok(Box::new(decoder))
}

/// Refuses what has to be converted first, by name or content. Raw files are TIFF with a small preview, which would be
/// decoded in place of the picture.
fn refuse_unread(path: &Path, start: &[u8]) -> Result<(), DataError> {
    use ImageFormat::{Bmp, Jpeg, OpenExr, Png, Pnm, WebP};
    let is_named_wrongly = matches!(guess_format(start), Ok(Bmp | Jpeg | OpenExr | Png | Pnm | WebP));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let brands = [b"heic", b"heix", b"hevc", b"mif1", b"msf1", b"avif"];
    let is_heif =
        start.get(4..8) == Some(b"ftyp") && brands.iter().any(|b| start.get(8..12) == Some(b.as_slice()));
    let command = match conversion(&name) {
        Some(command) if !is_named_wrongly => Some(command),
        _ if is_heif => {
            conversion(&format!("{name}.heic")).map(|command| format!("mv {name} {name}.heic; {command}"))
        }
        _ => None,
    };
    command.map_or(Ok(()), |command| Err(DataError::Unread { path: path.to_owned(), command }))
}
