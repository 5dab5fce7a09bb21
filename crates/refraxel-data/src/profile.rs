//! Colour profiles (ICC) of pictures: their names, for what is said about them.

/// The name of a profile of colours that are not sRGB; `None` for sRGB and for profiles of grey pictures.
///
/// Source: ICC.1:2022, sections 7.2 and 10.13; a description of version 2 is ASCII.
pub(crate) fn other_than_srgb(profile: &[u8]) -> Option<String> {
    if profile.get(16..20)? != b"RGB " {
        return None;
    }
    let name = description(profile).unwrap_or_else(|| "without a name".to_owned());
    let is_srgb = name.to_ascii_lowercase().contains("srgb");
    (!is_srgb).then_some(name)
}

/// Of the table of tags behind the 128 bytes of the header, the text of the tag `desc`.
fn description(profile: &[u8]) -> Option<String> {
    let number = |at: usize| {
        let bytes = profile.get(at..)?.first_chunk()?;
        Some(u32::from_be_bytes(*bytes) as usize)
    };
    let mut tags = (0..number(128)?.min(100)).map(|k| 132 + 12 * k);
    let tag = tags.find(|&at| profile.get(at..at + 4) == Some(b"desc"))?;
    let (start, size) = (number(tag + 4)?, number(tag + 8)?);
    let text = profile.get(start..start.checked_add(size)?)?;
    let name = match text.get(..4)? {
        b"desc" => String::from_utf8_lossy(text.get(12..)?.split(|b| *b == 0).next()?).into_owned(),
        b"mluc" => {
            let (length, offset) = (number(start + 20)?, number(start + 24)?);
            let units = text.get(offset..offset.checked_add(length)?)?.chunks_exact(2);
            String::from_utf16_lossy(&units.map(|u| u16::from_be_bytes([u[0], u[1]])).collect::<Vec<_>>())
        }
        _ => return None,
    };
    let name: String = name.chars().filter(|c| !c.is_control()).take(60).collect();
    Some(name).filter(|name| !name.trim().is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A profile of RGB that has nothing but a description.
    fn profile(text: &[u8]) -> Vec<u8> {
        let mut all = vec![0; 128];
        all[16..20].copy_from_slice(b"RGB ");
        all.extend(1_u32.to_be_bytes());
        all.extend(b"desc");
        all.extend(144_u32.to_be_bytes());
        all.extend((text.len() as u32).to_be_bytes());
        all.extend(text);
        all
    }

    #[test]
    fn profiles_of_both_versions_have_their_names() {
        let ascii = [b"desc\0\0\0\0\0\0\0\x11".as_slice(), b"Adobe RGB (1998)\0"].concat();
        assert_eq!(other_than_srgb(&profile(&ascii)).unwrap(), "Adobe RGB (1998)");
        let utf16: Vec<u8> = "Display P3".encode_utf16().flat_map(u16::to_be_bytes).collect();
        let head = b"mluc\0\0\0\0\0\0\0\x01\0\0\0\x0cenUS\0\0\0\x14\0\0\0\x1c".as_slice();
        assert_eq!(other_than_srgb(&profile(&[head, &utf16].concat())).unwrap(), "Display P3");
    }

    #[test]
    fn srgb_and_what_is_no_profile_are_not_named() {
        let srgb = [b"desc\0\0\0\0\0\0\0\x12".as_slice(), b"sRGB IEC61966-2.1\0"].concat();
        let whole = profile(&srgb);
        assert_eq!(other_than_srgb(&whole), None);
        for cut in 0..whole.len() {
            let _ = other_than_srgb(&whole[..cut]);
        }
    }
}
