//! PNG files that were changed, with right checksums again: so that what lies behind the checksums is reached.

const SIGNATURE: usize = 8;

/// The file, every chunk of which has the checksum of its content.
pub fn with_right_sums(file: &[u8]) -> Vec<u8> {
    let mut repaired = file.to_vec();
    let mut at = SIGNATURE;
    while let Some(length) = repaired.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let Some(end) = at.checked_add(8).and_then(|n| n.checked_add(length)) else { break };
        let Some(content) = repaired.get(at + 4..end) else { break };
        let sum = crc32fast::hash(content).to_be_bytes();
        let Some(stored) = repaired.get_mut(end..end + 4) else { break };
        stored.copy_from_slice(&sum);
        at = end + 4;
    }
    repaired
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_picture_gets_right_sums_and_an_unchanged_one_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        image::RgbImage::new(4, 4).save(&path).unwrap();
        let valid = std::fs::read(&path).unwrap();
        assert_eq!(with_right_sums(&valid), valid);
        let mut other = valid.clone();
        other[19] = 3; // the width
        assert_ne!(with_right_sums(&other), other);
        std::fs::write(&path, &other).unwrap();
        assert!(image::open(&path).is_err(), "its sum is wrong");
        std::fs::write(&path, with_right_sums(&other)).unwrap();
        assert_eq!(image::open(&path).unwrap().width(), 3);
    }
}
