//! No file, however damaged, makes an importer panic, hang or ask for absurd memory.

mod fixture;

use fixture::*;
use proptest::prelude::*;
use refraxel_data::{Dataset, OpenOptions, report};
use tempfile::TempDir;

/// Formats that [`dataset`] writes.
const FORMATS: usize = 5;

/// A small valid dataset of one format and the names of the files to damage.
fn dataset(format: usize) -> (TempDir, Vec<&'static str>) {
    let all = cameras(3);
    if format == 0 {
        return (transforms_folder(3, |t| t["k1"] = serde_json::json!(0.1)), vec!["transforms.json"]);
    }
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, content: Vec<u8>| write_file(folder.path(), name, content);
    (0..3).for_each(|i| write_image(folder.path(), &format!("images/{}.png", stem(i)), WIDTH, HEIGHT));
    let files = match format {
        1 => {
            write_colmap(folder.path(), "sparse/0", "bin", colmap_binary(&all));
            vec!["sparse/0/cameras.bin", "sparse/0/images.bin", "sparse/0/points3D.bin"]
        }
        2 => {
            write_colmap(folder.path(), "sparse/0", "txt", colmap_text(&all));
            vec!["sparse/0/cameras.txt", "sparse/0/images.txt", "sparse/0/points3D.txt"]
        }
        3 => {
            write("poses_bounds.npy", llff(&all));
            vec!["poses_bounds.npy"]
        }
        _ => {
            (0..3).for_each(|i| write(&format!("pose/{}.txt", stem(i)), nsvf_pose(&all[i]).into_bytes()));
            write("intrinsics.txt", b"30 12 8 0.\n0. 0. 0.\n".to_vec());
            write("bbox.txt", b"-1 -1 -1 1 1 1 0.1".to_vec());
            vec!["pose/r_1.txt", "intrinsics.txt", "bbox.txt"]
        }
    };
    (folder, files)
}

/// Opens, and reports on success; the result does not matter.
fn try_all(folder: &TempDir) -> bool {
    let opened = Dataset::open(folder.path(), &OpenOptions::default());
    opened.as_ref().map(report).map_err(ToString::to_string).is_ok()
}

#[test]
fn files_cut_at_any_byte_never_panic() {
    for (folder, files) in (0..FORMATS).map(dataset) {
        assert!(try_all(&folder), "the undamaged dataset opens");
        for file in files {
            let path = folder.path().join(file);
            let whole = std::fs::read(&path).unwrap();
            for cut in 0..whole.len() {
                std::fs::write(&path, &whole[..cut]).unwrap();
                try_all(&folder);
            }
            std::fs::write(&path, &whole).unwrap();
        }
    }
}

#[test]
fn a_count_beyond_the_file_is_an_error_not_an_allocation() {
    let folder = &dataset(1).0;
    for (file, at) in [("cameras", 0), ("images", 0), ("points3D", 0), ("images", 82)] {
        let path = folder.path().join(format!("sparse/0/{file}.bin"));
        let whole = std::fs::read(&path).unwrap();
        let mut damaged = whole.clone();
        damaged[at..at + 8].copy_from_slice(&(u64::MAX / 3).to_le_bytes());
        std::fs::write(&path, damaged).unwrap();
        let message = refusal(folder);
        assert!(message.contains(file) && message.contains("byte"), "{message}");
        std::fs::write(&path, whole).unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn files_with_any_changed_bytes_never_panic(which in 0..FORMATS, changes in prop::collection::vec((any::<u16>(), any::<u8>()), 1..6)) {
        let (folder, files) = dataset(which);
        for file in files {
            let path = folder.path().join(file);
            let mut content = std::fs::read(&path).unwrap();
            let length = content.len();
            changes.iter().for_each(|(at, byte)| content[usize::from(*at) % length] = *byte);
            std::fs::write(&path, content).unwrap();
            try_all(&folder);
        }
    }

    #[test]
    fn files_of_random_bytes_never_panic(which in 0..FORMATS, content in prop::collection::vec(any::<u8>(), 0..300)) {
        let (folder, files) = dataset(which);
        for file in files {
            std::fs::write(folder.path().join(file), &content).unwrap();
            try_all(&folder);
        }
    }

    #[test]
    fn any_number_in_a_valid_description_never_panics(value in any::<f64>(), which in 0_usize..12) {
        let keys = ["fl_x", "fl_y", "cx", "cy", "w", "h", "k1", "camera_angle_x", "x_fov", "p1", "k4", "scale"];
        let folder = transforms_folder(3, |t| {
            t[keys[which]] = serde_json::json!(value);
            t["render_aabb"] = serde_json::json!([[0, 0, 0], [1, 1, 1]]);
            t["frames"][1]["transform_matrix"][which % 3][which / 3] = serde_json::json!(value);
        });
        try_all(&folder);
    }
}
