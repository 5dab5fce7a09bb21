//! Extensions of files: pictures that are read, pictures that have to be converted first, and videos.

use std::path::Path;

/// Pictures that are decoded. Names without an extension are tried in this order.
pub(crate) const READ: [&str; 12] =
    ["png", "jpg", "jpeg", "jfif", "exr", "webp", "tif", "tiff", "bmp", "ppm", "pgm", "tga"];
/// Pictures of linear light, which programs that pose photographs do not read.
const LINEAR: [&str; 1] = ["exr"];
/// Pictures that are not decoded, and the program that converts them.
const UNREAD: [(&[&str], &str); 4] = [
    (&["heic", "heif", "hif", "avif"], "heif-convert"),
    (&["dng", "cr2", "cr3", "nef", "nrw", "arw", "raf", "orf", "rw2", "pef", "srw"], "darktable-cli"),
    (&["jxl"], "djxl"),
    (&["jp2", "j2k", "hdr", "qoi", "psd", "gif"], "magick"),
];
/// Videos.
const VIDEO: [&str; 12] =
    ["mp4", "mov", "m4v", "avi", "mkv", "webm", "mpg", "mpeg", "3gp", "mts", "m2ts", "wmv"];

/// Packed files, and the command that unpacks them.
const PACKED: [(&[&str], &str); 3] = [
    (&["zip", "r3d"], "unzip"),
    (&["tar", "tgz", "gz", "bz2", "xz", "zst"], "tar -xf"),
    (&["7z", "rar"], "7z x"),
];

/// True for the name of a picture that can be decoded.
pub(crate) fn is_picture(name: &str) -> bool {
    has(name, &READ)
}

/// True for the name of a photograph that can be decoded and that programs can pose.
pub(crate) fn is_photograph(name: &str) -> bool {
    has(name, &READ) && !has(name, &LINEAR)
}

/// The command that makes a JPEG of a picture that is not decoded, such as `heif-convert IMG.heic IMG.jpg`; `None` for
/// other names.
pub fn conversion(name: &str) -> Option<String> {
    let (_, program) = UNREAD.iter().find(|(extensions, _)| has(name, extensions))?;
    let to = if *program == "djxl" { "png" } else { "jpg" };
    Some(format!("{program} {name} {}", Path::new(name).with_extension(to).display()))
}

/// The command that unpacks a file, such as `unzip a.zip -d a`; `None` for names of other files.
pub(crate) fn unpacking(name: &str) -> Option<String> {
    let (_, command) = PACKED.iter().find(|(extensions, _)| has(name, extensions))?;
    let folder = Path::new(name).with_extension("");
    Some(match *command {
        // These often hold no folder of their own.
        "unzip" => format!("unzip {name} -d {}", folder.display()),
        command => format!("{command} {name}"),
    })
}

/// True for the name of a video.
pub fn is_video(path: &Path) -> bool {
    path.file_name().and_then(|n| n.to_str()).is_some_and(|name| has(name, &VIDEO))
}

/// Whether a name ends in one of these, in capitals or not.
fn has(name: &str, extensions: &[&str]) -> bool {
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    extensions.contains(&extension.to_ascii_lowercase().as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn videos_are_known_by_their_extension() {
        assert!(is_video(Path::new("a/walk.MP4")) && is_video(Path::new("b.webm")));
        assert!(!is_video(Path::new("mp4")) && !is_video(Path::new("a.png")));
    }

    #[test]
    fn what_is_packed_has_a_command_that_unpacks_it() {
        assert_eq!(unpacking("a/walk.R3D").unwrap(), "unzip a/walk.R3D -d a/walk");
        assert_eq!(unpacking("b.tar.gz").unwrap(), "tar -xf b.tar.gz");
        assert_eq!((unpacking("zip"), unpacking("a.png")), (None, None));
    }

    #[test]
    fn what_is_not_read_has_a_command_that_converts_it() {
        assert_eq!(conversion("a/b.HEIC").unwrap(), "heif-convert a/b.HEIC a/b.jpg");
        assert_eq!(conversion("x.cr3").unwrap(), "darktable-cli x.cr3 x.jpg");
        assert_eq!((conversion("a.webp"), conversion("a.txt"), conversion("heic")), (None, None, None));
        assert!(is_picture("a.jfif") && is_photograph("a.jfif"));
        assert!(
            is_picture("a.TIF") && is_photograph("a.TIF") && is_picture("a.exr") && !is_photograph("a.exr")
        );
    }
}
