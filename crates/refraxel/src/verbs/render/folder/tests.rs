use super::*;
use tempfile::TempDir;

fn files(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// A folder that holds a render of these files.
fn rendered(names: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    render(folder.path(), names, Earlier::Keep).unwrap();
    folder
}

fn render(root: &Path, names: &[&str], earlier: Earlier) -> Result<(), Failure> {
    let mut folder = RenderFolder::open(root, &files(names), earlier)?;
    for name in names {
        folder.write(name, |path| fs::write(path, "new").or_exit(Exit::Io))?;
    }
    Ok(())
}

fn refused(root: &Path, names: &[&str], earlier: Earlier) -> String {
    let failure = render(root, names, earlier).unwrap_err();
    assert_eq!(failure.exit, Exit::BadInput);
    failure.report()
}

#[test]
fn an_earlier_render_is_refused_and_stays() {
    let folder = rendered(&["0000.png", "depth/0000.png"]);
    let message = refused(folder.path(), &["other.png"], Earlier::Keep);
    assert!(message.contains("0000.png, depth/0000.png") && message.contains("--overwrite"), "{message}");
    assert!(folder.path().join("depth/0000.png").is_file() && !folder.path().join("other.png").exists());
}

#[test]
fn overwriting_removes_what_a_render_wrote_and_nothing_else() {
    let folder = rendered(&["0000.png", "0001.png", "depth/0001.png", "index/0001.png"]);
    fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    fs::write(folder.path().join("index/mine.png"), "mine").unwrap();
    render(folder.path(), &["0000.png"], Earlier::Remove).unwrap();
    let exists = |name: &str| folder.path().join(name).exists();
    assert!(exists("0000.png") && exists("notes.txt") && exists("index/mine.png"));
    assert!(!exists("0001.png") && !exists("depth") && !exists("index/0001.png"));
    // The record tells of the new render alone.
    assert_eq!(read_record(folder.path()).unwrap(), files(&["0000.png"]));
}

#[test]
fn files_of_the_user_are_named_and_stay_even_when_overwriting() {
    let folder = rendered(&["0000.png"]);
    let mine = folder.path().join("0001.png");
    fs::write(&mine, "mine").unwrap();
    let message = refused(folder.path(), &["0000.png", "0001.png"], Earlier::Remove);
    assert!(message.contains("new ones: 0001.png;"), "{message}");
    assert_eq!(fs::read_to_string(&mine).unwrap(), "mine");
    assert!(folder.path().join("0000.png").is_file(), "nothing is removed before all is well");
}

#[test]
fn a_file_in_the_place_of_a_folder_is_in_the_way() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("depth"), "mine").unwrap();
    assert!(refused(folder.path(), &["depth/0000.png"], Earlier::Remove).contains("depth/0000.png"));
}

#[test]
fn a_render_that_was_stopped_is_recorded_as_far_as_it_came() {
    let folder = tempfile::tempdir().unwrap();
    let planned = files(&["0000.png", "0001.png", "0002.png"]);
    let mut first = RenderFolder::open(folder.path(), &planned, Earlier::Keep).unwrap();
    first.write("0000.png", |path| fs::write(path, "new").or_exit(Exit::Io)).unwrap();
    first.write("0001.png", |_| Err(refusal("disk full".to_owned()))).unwrap_err();
    let record = folder.path().join(RECORD);
    let text = fs::read_to_string(&record).unwrap();
    fs::write(&record, text + "0002.p").unwrap(); // cut off
    assert_eq!(read_record(folder.path()).unwrap(), files(&["0000.png"]));
}

#[test]
fn a_folder_whose_pictures_were_moved_away_is_free_again() {
    let folder = rendered(&["0000.png"]);
    fs::remove_file(folder.path().join("0000.png")).unwrap();
    render(folder.path(), &["0000.png"], Earlier::Keep).unwrap();
}

#[test]
fn a_record_that_leads_elsewhere_removes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let victim = folder.path().join("victim");
    fs::write(&victim, "mine").unwrap();
    let root = folder.path().join("out");
    fs::create_dir(&root).unwrap();
    for line in ["../victim", victim.to_str().unwrap(), RECORD] {
        fs::write(root.join(RECORD), format!("{HEADING}{line}\n")).unwrap();
        assert!(refused(&root, &["0000.png"], Earlier::Remove).contains("damaged"), "{line}");
    }
    fs::write(root.join(RECORD), "my own list\n").unwrap();
    assert!(refused(&root, &["0000.png"], Earlier::Remove).contains("no record of a render"));
    assert!(victim.exists());
}

#[test]
fn long_lists_are_counted() {
    let names: Vec<String> = (0..60).map(|k| format!("{k:04}.png")).collect();
    let all: Vec<&String> = names.iter().collect();
    assert_eq!(list(&all), "0000.png, 0001.png, 0002.png and 57 more");
    assert_eq!(list(&all[..2]), "0000.png, 0001.png");
}
