//! Which views are held out: every convention in use is obeyed, or said not to be.

use crate::fixture::*;
use refraxel_data::{DataError, Dataset, OpenOptions};
use serde_json::json;
use std::path::Path;
use tempfile::TempDir;

/// Names of the views of the training, validation and test part.
fn parts(data: &Dataset) -> [Vec<&str>; 3] {
    let names = |views: &[usize]| views.iter().map(|&i| data.views[i].name.as_str()).collect();
    [names(&data.split.train), names(&data.split.val), names(&data.split.test)]
}

/// A dataset of eight views with a file beside it.
fn beside(file: &str, content: &str) -> TempDir {
    let folder = transforms_folder(8, |_| {});
    write_file(folder.path(), file, content);
    folder
}

/// A COLMAP model of eight views.
fn colmap() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_colmap(folder.path(), "sparse/0", "txt", colmap_text(&cameras(8)));
    (0..8).for_each(|i| write_image(folder.path(), &format!("images/{}.png", stem(i)), WIDTH, HEIGHT));
    folder
}

#[test]
fn lists_beside_the_description_are_obeyed_in_all_their_forms() {
    for (file, content) in [
        ("test_list.txt", "r_5\nimages/r_7.png\n"),
        ("test.txt", "\u{feff}r_5.png\r\n\r\n./images/r_7.png\r\n"),
        ("Test.TXT", "R_5.JPG\nC:\\scene\\images\\r_7.png\n"),
        ("val_names.txt", "# held out\nr_5.png\nr_7.png\n"),
        ("test.txt", "5\n7\n"),
        ("test.txt", "\"r_5.png\" ,\n'r_7.png'\n"),
        ("test.txt", "r_5.png, r_7.png"),
        ("test.txt", "[r_5; r_7]\n"),
        ("test.txt", "r_5.png r_7.png\n"),
        ("test.txt", "5,7"),
        ("train.txt", "r_0\nr_1\nr_2\nr_3\nr_4\nr_6\n"),
        ("trainval.txt", "r_0\nr_1\nr_2\nr_3\nr_4\nr_6\n"),
        ("test.json", r#"["r_5.png", "r_7.png"]"#),
        ("split.json", r#"{"test": ["images/r_5.png", "images/r_7.png"], "has_masks": false}"#),
        (
            "train_test_lists.json",
            r#"{"train": ["r_0", "r_1", "r_2", "r_3", "r_4", "r_6"], "test": ["r_5", "r_7"]}"#,
        ),
        ("train_test_split.json", r#"{"test_ids": [5, 7]}"#),
        ("splits.json", r#"{"scene": {"eval_filenames": ["r_5.png", "r_7.png"]}}"#),
        (
            "scene.tsv",
            "filename\tid\tsplit\tdataset\nr_5.png\t1\ttest\ts\nr_0.png\t2\ttrain\ts\nr_7.png\t3\ttest\ts\n",
        ),
        ("train_test_split.txt", "r_5.png test\nr_0.png train\nr_7.png, test\n"),
        ("splits/test.txt", "r_5.png\nr_7.png\n"),
        (
            "splits.json",
            r#"[{"file": "r_5.png", "split": "test"}, {"file_path": "images/r_7.png", "is_test": true},
                {"file": "r_0.png", "split": "train"}]"#,
        ),
        ("data_split.json", r#"{"r_5.png": "test", "r_7.png": "test", "r_0.png": "train"}"#),
    ] {
        let folder = beside(file, content);
        let data = open(&folder).unwrap_or_else(|error| panic!("{file}: {error}"));
        let [train, val, test] = parts(&data);
        let held_out = [val, test].concat();
        assert_eq!(held_out, ["r_5.png", "r_7.png"], "{file} {content}: {:?}", data.problems);
        assert!(
            ["data_split.json", "scene.tsv", "train_test_split.txt"].contains(&file)
                || content.starts_with("[{")
                || train.len() == 6,
            "{file}"
        );
        assert!(data.split.rule.contains(file), "{}", data.split.rule);
    }
}

#[test]
fn lists_in_the_folder_of_a_colmap_model_are_obeyed() {
    for (file, train) in [("sparse/0/test.txt", 6), ("sparse/test_list.txt", 6)] {
        let folder = colmap();
        write_file(folder.path(), file, "r_5.png\nr_7.png\n");
        let data = open(&folder).unwrap();
        let [found, _, test] = parts(&data);
        assert_eq!((found.len(), test), (train, vec!["r_5.png", "r_7.png"]), "{file}");
    }
}

#[test]
fn numbers_count_the_views_of_a_model_by_name_and_names_that_are_numbers_are_names() {
    let folder = colmap();
    write_file(folder.path(), "split.json", r#"{"test": [0, 7]}"#);
    assert_eq!(parts(&open(&folder).unwrap())[2], ["r_0.png", "r_7.png"]);
    let numbered = transforms_folder(4, |t| {
        (0..4).for_each(|i| t["frames"][i]["file_path"] = json!(format!("images/{}.png", 3 - i)));
    });
    (0..4).for_each(|i| write_image(numbered.path(), &format!("images/{i}.png"), WIDTH, HEIGHT));
    write_file(numbered.path(), "test.txt", "0\n");
    assert_eq!(parts(&open(&numbered).unwrap())[2], ["0.png"]);
    // Of no name, in an order that may be another: said.
    let turned = transforms_folder(4, |t| t["frames"].as_array_mut().unwrap().reverse());
    write_file(turned.path(), "test.txt", "0\n");
    let data = open(&turned).unwrap();
    assert_eq!(parts(&data)[2], ["r_3.png"]);
    assert!(warns(&data, "they are taken to count the views from 0 on, in the order of the file"));
}

#[test]
fn numbers_count_views_that_are_lost_too() {
    let folder = transforms_folder(8, |t| t["frames"][1]["transform_matrix"] = json!(null));
    write_file(folder.path(), "test.txt", "5\n");
    assert_eq!(parts(&open(&folder).unwrap())[2], ["r_5.png"]);
}

#[test]
fn the_key_split_of_frames_is_obeyed() {
    let folder = transforms_folder(6, |t| {
        for (i, part) in ["train", "eval", "train", "val", "test", "training"].iter().enumerate() {
            t["frames"][i]["split"] = json!(part);
        }
    });
    let data = open(&folder).unwrap();
    assert_eq!(parts(&data).map(|names| names.len()), [3, 1, 2]);
    for (key, train, test) in [
        ("subset", json!("train"), json!("test")),
        ("is_test", json!(false), json!(true)),
        ("train", json!(true), json!(false)),
    ] {
        let folder = transforms_folder(6, |t| {
            (0..6).for_each(|i| t["frames"][i][key] = if i == 4 { test.clone() } else { train.clone() });
        });
        let data = open(&folder).unwrap();
        assert_eq!((parts(&data)[2].clone(), data.split.train.len()), (vec!["r_4.png"], 5), "{key}");
        assert!(data.split.rule.contains(key), "{}", data.split.rule);
    }
    let odd = transforms_folder(4, |t| t["frames"][2]["split"] = json!("later"));
    assert!(warns(&open(&odd).unwrap(), "frames[2].split names no part of a split"));
}

#[test]
fn lists_of_held_out_frames_and_numbers_in_the_description_are_obeyed() {
    let lists = transforms_folder(6, |t| {
        let frames = t["frames"].as_array_mut().unwrap();
        let held_out = frames.split_off(4);
        t["test_frames"] = json!(held_out);
    });
    let data = open(&lists).unwrap();
    assert_eq!((data.split.train.len(), parts(&data)[2].clone()), (4, vec!["r_4.png", "r_5.png"]));
    for (key, value) in [
        ("test_ids", json!([1, 3])),
        ("i_test", json!([1, 3])),
        ("splits", json!({"train": ["r_0", "r_2", "r_4", "r_5"], "test": ["r_1", "r_3"]})),
        ("train_test_split", json!({"test": ["images/r_1.png", "images/r_3.png"]})),
    ] {
        let folder = transforms_folder(6, |t| t[key] = value.clone());
        assert_eq!(parts(&open(&folder).unwrap())[2], ["r_1.png", "r_3.png"], "{key}");
    }
}

#[test]
fn held_out_views_beside_a_description_of_all_are_added_or_marked() {
    for (has_all, held_out) in [(true, 4..6), (false, 4..6)] {
        let mut other = transforms(&cameras(6));
        let frames = other["frames"].as_array_mut().unwrap();
        *frames = frames[held_out].to_vec();
        let folder = transforms_folder(6, |t| {
            let frames = t["frames"].as_array_mut().unwrap();
            frames.truncate(if has_all { 6 } else { 4 });
        });
        write_file(folder.path(), "transforms_test.json", other.to_string());
        let data = open(&folder).unwrap();
        assert_eq!((data.split.train.len(), parts(&data)[2].clone()), (4, vec!["r_4.png", "r_5.png"]));
        assert_eq!((data.views.len(), data.problems.len()), (6, 0), "{:?}", data.problems);
        assert_eq!(data.split.rule, "transforms.json, transforms_test.json");
    }
}

#[test]
fn names_and_folders_that_state_a_split_are_obeyed_where_all_do() {
    let named = |names: [&str; 4]| {
        let folder = transforms_folder(4, |t| {
            (0..4).for_each(|i| t["frames"][i]["file_path"] = json!(format!("images/{}.png", names[i])));
        });
        names
            .iter()
            .for_each(|name| write_image(folder.path(), &format!("images/{name}.png"), WIDTH, HEIGHT));
        folder
    };
    for names in [
        ["frame_train_00001", "frame_train_00002", "frame_train_00003", "frame_eval_00001"],
        ["train/a", "train/b", "train/c", "test/a"],
        ["train_0", "train_1", "train_2", "val_0"],
    ] {
        let data = open(&named(names)).unwrap();
        let held_out = [data.split.val.clone(), data.split.test.clone()].concat();
        assert_eq!((data.split.train.len(), held_out), (3, vec![3]), "{names:?}: {}", data.split.rule);
    }
    let some = open(&named(["a", "b", "test/c", "test/d"])).unwrap();
    assert_eq!(some.split.test.len(), 1, "one view in eight");
    assert_reports(&some, "but not of all images (2 of 4): they are not obeyed");
    let all = open(&named(["test_0", "test_1", "test_2", "test_3"])).unwrap();
    assert!(all.split.train.len() == 3 && !reports(&all, "obeyed"), "{:?}", all.problems);
}

#[test]
fn the_description_is_obeyed_before_lists_beside_it_and_a_contradiction_is_said() {
    let folder = transforms_folder(8, |t| t["test_filenames"] = json!(["images/r_2.png"]));
    write_file(folder.path(), "test_list.txt", "r_2.png\n");
    let data = open(&folder).unwrap();
    assert!(parts(&data)[2] == ["r_2.png"] && data.problems.is_empty(), "{:?}", data.problems);
    write_file(folder.path(), "test_list.txt", "r_5.png\n");
    let data = open(&folder).unwrap();
    assert_eq!(parts(&data)[2], ["r_2.png"]);
    assert_warns(&data, "test_list.txt says otherwise of 2 views");
    let blender = blender_folder([4, 2], 6);
    write_file(blender.path(), "test.txt", "r_0.png\n");
    let data = open(&blender).unwrap();
    assert_eq!(parts(&data)[2], ["r_4.png", "r_5.png"]);
    assert_warns(&data, "transforms_{train,test}.json is used; test.txt says otherwise");
}

#[test]
fn images_that_are_learned_from_and_held_out_are_a_warning() {
    let folder = blender_folder([4, 2], 6);
    assert!(open(&folder).unwrap().problems.is_empty());
    let train = folder.path().join("transforms_train.json");
    std::fs::copy(train, folder.path().join("transforms_test.json")).unwrap();
    assert!(warns(&open(&folder).unwrap(), "4 held-out images are among those to learn from as well"));
}

#[test]
fn lists_that_name_no_view_are_a_warning_and_not_obeyed() {
    for file in ["test.txt", "test_list.txt", "train.txt", "split.json"] {
        let content = if file.ends_with("json") { r#"{"train": ["x1", "x2"]}"# } else { "x1\nx2\n" };
        let data = open(&beside(file, content)).unwrap();
        assert_eq!(parts(&data)[2], ["r_0.png"], "{file}: one view in eight");
        assert_warns(&data, &format!("{file}: none of its names is that of a view (x1, x2)"));
    }
    let data = open(&beside("split.json", r#"{"author": "nobody"}"#)).unwrap();
    assert_warns(&data, "it holds no lists of views");
    let data = open(&beside("notes_on_tests.txt", "r_5.png")).unwrap();
    assert!(data.problems.is_empty(), "{:?}", data.problems);
}

#[test]
fn lists_in_formats_that_are_not_read_are_a_warning() {
    let data = open(&beside("split.yaml", "test:\n- r_5.png\n")).unwrap();
    assert_warns(&data, "split.yaml: lists are read as .txt");
}

#[test]
fn names_of_lists_that_are_those_of_no_view_are_named() {
    let data = open(&beside("test.txt", "r_5.png\nr_50.png\n")).unwrap();
    assert_warns(&data, "test.txt: 1 names in it are those of no view: r_50.png");
    let few = beside("train.txt", "r_1.png\nr_2.png\nr_3.png\n");
    let data = open(&few).unwrap();
    assert_eq!((data.split.train.len(), data.split.test.len()), (3, 5));
    assert!(data.split.rule.contains("the others are held out"), "{}", data.split.rule);
    write_file(few.path(), "test.txt", "r_0.png\n");
    assert!(warns(
        &open(&few).unwrap(),
        "4 views are in no list of the split and are not used: images/r_4.png"
    ));
    std::fs::remove_file(few.path().join("test.txt")).unwrap();
    write_file(few.path(), "train.txt", "r_1.png\nr_2.png\nr_3.png\nx_4.png\n");
    assert!(matches!(open(&few), Err(DataError::ViewsLost { lost: 5, count: 8, .. })));
}

#[test]
fn views_that_are_listed_to_train_and_to_be_held_out_are_held_out() {
    let folder = beside(
        "split.json",
        r#"{"train": ["r_0", "r_1", "r_2", "r_3", "r_4", "r_5", "r_6"], "test": ["r_6", "r_7"]}"#,
    );
    let data = open(&folder).unwrap();
    assert_eq!(parts(&data)[2], ["r_6.png", "r_7.png"]);
    assert_warns(&data, "1 views are listed to train and to be held out");
}

#[test]
fn the_option_is_ignored_beside_a_stated_split_and_obeyed_by_nsvf_without_one() {
    let options = OpenOptions { holdout: Some(2), ..OpenOptions::default() };
    let folder = beside("test.txt", "r_5.png\n");
    let data = Dataset::open(folder.path(), &options).unwrap();
    assert!(parts(&data)[2] == ["r_5.png"] && warns(&data, "the hold-out option is ignored"));
    let nsvf = tempfile::tempdir().unwrap();
    for (i, camera) in cameras(6).iter().enumerate() {
        write_file(nsvf.path(), &format!("pose/{}.txt", stem(i)), nsvf_pose(camera));
        write_image(nsvf.path(), &format!("rgb/{}.png", stem(i)), WIDTH, HEIGHT);
    }
    write_file(nsvf.path(), "intrinsics.txt", "30 12 8 0.\n0. 0. 0.\n");
    let held_out = |options: &OpenOptions| Dataset::open(nsvf.path(), options).unwrap().split.test.len();
    assert_eq!((held_out(&options), held_out(&OpenOptions::default())), (3, 1));
}

#[cfg(unix)]
#[test]
fn a_list_that_leads_out_of_the_dataset_is_not_read() {
    let folder = transforms_folder(8, |_| {});
    let other = tempfile::tempdir().unwrap();
    write_file(other.path(), "secret", "r_5.png\n");
    std::os::unix::fs::symlink(other.path().join("secret"), folder.path().join("test.txt")).unwrap();
    assert_eq!(parts(&open(&folder).unwrap())[2], ["r_0.png"]);
    assert!(Path::new(&folder.path().join("test.txt")).exists());
}

#[test]
fn an_empty_list_is_named() {
    let data = open(&beside("test.txt", "# none yet\n\n")).unwrap();
    assert_warns(&data, "test.txt names no views");
    assert!(data.split.rule.starts_with("one view in 8"));
}

#[test]
fn photographs_with_clutter_train_and_those_without_test() {
    let folder = transforms_folder(6, |t| {
        for i in 0..6 {
            let kind = if i < 4 { "2clutter" } else { "1extra" };
            t["frames"][i]["file_path"] = json!(format!("images/{kind}{i:03}.png"));
        }
    });
    (0..6).for_each(|i| {
        let kind = if i < 4 { "2clutter" } else { "1extra" };
        write_image(folder.path(), &format!("images/{kind}{i:03}.png"), WIDTH, HEIGHT);
    });
    assert_eq!(parts(&open(&folder).unwrap()).map(|names| names.len()), [4, 0, 2]);
}

#[test]
fn keys_of_a_split_that_are_not_obeyed_are_named() {
    let folder = transforms_folder(8, |t| t["llffhold"] = json!(4));
    assert!(warns(&open(&folder).unwrap(), "llffhold is not obeyed"));
    for (edit, why) in [
        (json!({"llffhold": 8}), "it is what happens anyway"),
        (json!({"eval_mode": "filename", "test_filenames": ["images/r_5.png"]}), "the list is obeyed"),
    ] {
        let folder =
            transforms_folder(8, |t| t.as_object_mut().unwrap().extend(edit.as_object().unwrap().clone()));
        assert!(!reports(&open(&folder).unwrap(), "is not obeyed"), "{why}");
    }
}

#[test]
fn prose_that_holds_numbers_of_views_is_no_list() {
    for (file, text) in [
        ("train.txt", "epoch 1 loss 0.35\nepoch 2 loss 0.22, 15 minutes\n"),
        ("test.txt", "a test of 3 things, with 5 views\n"),
    ] {
        let folder = transforms_folder(8, |t| {
            (0..8).for_each(|i| t["frames"][i]["file_path"] = json!(format!("images/{i}.png")));
        });
        (0..8).for_each(|i| write_image(folder.path(), &format!("images/{i}.png"), WIDTH, HEIGHT));
        write_file(folder.path(), file, text);
        let data = open(&folder).unwrap();
        assert_eq!(parts(&data)[2], ["0.png"], "{file}");
        assert_warns(&data, "none of its names is that of a view");
    }
}

#[test]
fn an_extra_photograph_says_nothing_of_the_split() {
    let folder = transforms_folder(8, |t| t["frames"][3]["file_path"] = json!("images/extra_3.png"));
    write_image(folder.path(), "images/extra_3.png", WIDTH, HEIGHT);
    assert!(!reports(&open(&folder).unwrap(), "clutter"));
}
