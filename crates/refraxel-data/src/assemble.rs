//! From a parsed dataset to a dataset: image headers are read, poses and sizes checked, and masks, split and backdrop
//! decided.

use crate::camera::{Coincidence, MIN_VIEWS, coincidence, one_place, repairs};
use crate::decoding::Header;
use crate::looks::{Look, MaskLook};
use crate::masks::MaskFile;
use crate::orientation::{self, Picture};
use crate::parsed::{Frame, Intrinsics, Origin, ParsedDataset};
use crate::size::Size;
use crate::synth::IndexTruth;
use crate::{
    AlphaMeaning, AlphaUse, Backdrop, DataError, Dataset, LocalOrigin, MaskMeaning, NamedCamera, OpenOptions,
    Orientation, PhotoSource, Problem, View, alpha, backdrop, bars, camera, depth, json, looks, losses,
    masks, pose, readings, region, repetitions, split,
};
use refraxel_core::Camera;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Checks a parsed dataset and completes it.
pub(crate) fn assemble(
    path: &Path,
    mut parsed: ParsedDataset,
    options: &OpenOptions,
) -> Result<Dataset, DataError> {
    split::assign(path, &mut parsed)?;
    repetitions::resolve(&mut parsed)?;
    let headers = losses::leave_out(path, &mut parsed)?;
    if parsed.frames.len() < MIN_VIEWS {
        return Err(DataError::TooFewViews { path: path.to_owned(), found: parsed.frames.len() });
    }
    let split = split::decide(path, &mut parsed, options)?;
    let truth = truth(&mut parsed);
    let mut views = posed(&mut parsed, &headers, options)?;
    let stated = masks::find(&parsed, &views)?;
    parsed.problems.extend(depth::leave_out_turned(&mut views, &headers));
    parsed.problems.extend(depth::check(&mut views, &parsed.points)?);
    if !options.crop.is_none() {
        views = views.into_iter().map(|v| v.cropped(options.crop)).collect::<Result<_, _>>()?;
    }
    let backdrop = look(&mut parsed, &mut views, &headers, stated, truth.as_ref(), options)?;
    parsed.problems.extend(masks::summary(&views));
    let ParsedDataset { root, format, stated_box, points, depth_range, problems, up: measured, .. } = parsed;
    let root = Some(root.folder().to_owned());
    let up = options.up.or(measured).map(|up| up.normalized()).filter(|up| (up.length() - 1.0).abs() < 1e-6);
    let data = Dataset {
        root,
        format,
        origin: LocalOrigin::default(),
        views,
        split,
        backdrop,
        stated_box,
        up,
        points,
        depth_range,
        truth,
        problems,
    };
    let mut data = data.recentred(options.origin);
    check_distinct_poses(path, &mut data)?;
    Ok(data)
}

/// The views with their cameras, of the pixels that are meant.
fn posed(
    parsed: &mut ParsedDataset,
    headers: &[Header],
    options: &OpenOptions,
) -> Result<Vec<View>, DataError> {
    let pictures: Vec<Picture> = parsed.frames.iter().zip(headers).collect();
    let (orientations, turned) = orientation::decide(parsed, &pictures, options.orientation)?;
    let cameras = cameras(parsed, headers, &orientations)?;
    parsed.problems.extend(turned.into_iter().chain(profiles(headers)).chain(grey(headers)));
    let views = views(&parsed.frames, cameras, &orientations);
    parsed.problems.extend(parsed.stated_box.and_then(|bounds| region::unseen(&bounds, &views)));
    Ok(views)
}

/// Cameras with checked poses and with intrinsics at the real image size.
fn cameras(
    parsed: &mut ParsedDataset,
    headers: &[Header],
    orientations: &[Orientation],
) -> Result<Vec<Camera>, DataError> {
    let mut cameras = Vec::with_capacity(headers.len());
    let (mut poses, mut resized, mut implied) = (Vec::new(), Vec::new(), Vec::new());
    for ((frame, header), orientation) in parsed.frames.iter().zip(headers).zip(orientations) {
        let Origin { path, key } = &frame.origin;
        let checked = pose::check(&frame.pose).map_err(|fault| DataError::Pose {
            path: path.to_path_buf(),
            key: key.clone(),
            fault,
        })?;
        let real = size(header, *orientation);
        poses.push(checked);
        let stated = frame.intrinsics.size.filter(|stated| differs(*stated, real));
        resized.extend(stated.map(|stated| Resized { stated, real }));
        let other = frame.intrinsics.implied_size(real);
        implied.extend(other.map(|stated| Resized { stated, real }));
        let intrinsics = Intrinsics { size: frame.intrinsics.size.or(other), ..frame.intrinsics };
        cameras.push(intrinsics.camera(real, checked.pose, &frame.origin)?);
    }
    parsed.problems.extend(repairs(&poses));
    parsed.problems.extend(resizes(&resized));
    parsed.problems.extend(of_other_pictures(&implied));
    parsed.problems.extend(camera::doubts(&cameras).into_iter().chain(camera::in_degrees(&cameras)));
    let names: Vec<&str> = parsed.frames.iter().map(|f| f.file.as_str()).collect();
    parsed.problems.extend(camera::placeholder(&cameras, &names));
    let files: Vec<&Path> = parsed.frames.iter().map(|f| f.origin.path.as_path()).collect();
    parsed.problems.extend(camera::other_focal(&cameras, &files));
    Ok(cameras)
}

/// One view per frame.
fn views(frames: &[Frame], cameras: Vec<Camera>, orientations: &[Orientation]) -> Vec<View> {
    let parts = frames.iter().zip(orientations).zip(names(frames)).zip(cameras);
    let view = |(((frame, &of), name), camera): (((&Frame, &Orientation), String), Camera)| {
        let file = View::of_file(frame.image.clone().unwrap_or_default(), camera);
        let mut view = View { name, depth: frame.depth.clone(), ..file };
        if let PhotoSource::Files { orientation, .. } = &mut view.source {
            *orientation = of;
        }
        view
    };
    parts.map(view).collect()
}

/// Looks at a few photographs and decides what alpha, masks and borders mean: sets masks and the use of alpha, and gives the backdrop.
fn look(
    parsed: &mut ParsedDataset,
    views: &mut [View],
    headers: &[Header],
    mut stated: masks::Stated,
    truth: Option<&Value>,
    options: &OpenOptions,
) -> Result<Backdrop, DataError> {
    let (mut looks, alpha) = look_for_alpha(parsed, views, headers, &stated, options);
    if alpha == Some(AlphaMeaning::Mask) {
        stated.add_alpha(&parsed.frames, headers);
    }
    let marks_glass = truth.is_some_and(|truth| IndexTruth::listed(truth) > 0);
    let masks = masks::decide(parsed, stated, views, &looks, options, marks_glass)?;
    parsed.problems.extend(masks.problems);
    let is_cut_out = alpha == Some(AlphaMeaning::Backdrop);
    let alpha_use = match (is_cut_out, options.backdrop) {
        (true, Some(Backdrop::Color(colour))) => AlphaUse::Over(colour),
        (true, None) | (_, Some(Backdrop::Transparent)) => AlphaUse::Kept,
        _ => AlphaUse::LeftOut,
    };
    set_masks(views, headers, masks.masks, alpha_use);
    let mut on_border = masks.looks;
    if !is_cut_out {
        parsed.problems.extend(without_bars(&mut looks, &mut on_border));
    }
    let evidence = backdrop::Evidence { parsed, truth, views, looks: &looks, masks: &on_border, is_cut_out };
    let (backdrop, problem) = backdrop::decide(&evidence, options);
    parsed.problems.extend(problem);
    Ok(backdrop)
}

/// Looks at a few photographs, of those with alpha where it counts, of those with masks, or of all, and decides what alpha means.
fn look_for_alpha(
    parsed: &mut ParsedDataset,
    views: &[View],
    headers: &[Header],
    stated: &masks::Stated,
    options: &OpenOptions,
) -> (Vec<Look>, Option<AlphaMeaning>) {
    let of =
        |is_wanted: &dyn Fn(usize) -> bool| (0..views.len()).filter(|k| is_wanted(*k)).collect::<Vec<_>>();
    let groups = [of(&|k| headers[k].alpha), of(&|k| stated.masks[k].is_some()), of(&|_| true)];
    let look_among = |groups: &[Vec<usize>]| {
        looks::look(views, groups.iter().find(|group| !group.is_empty()).map_or(&[], Vec::as_slice))
    };
    let looks = look_among(&groups);
    parsed.problems.extend(looks::brightness(&looks));
    let are_masked = stated.masks.iter().any(Option::is_some);
    parsed.problems.extend(readings::doubt(parsed.format, views, &looks, are_masked));
    let alpha = alpha::decide(parsed, headers, &looks, options);
    parsed.problems.extend(alpha.problems);
    let is_left_out = alpha.meaning == Some(AlphaMeaning::Ignore) && groups[0].len() < views.len();
    (if is_left_out { look_among(&groups[1..]) } else { looks }, alpha.meaning)
}

/// Writes to views what covers their photographs, and what becomes of alpha where these have some.
fn set_masks(views: &mut [View], headers: &[Header], masks: Vec<Option<MaskFile>>, alpha_use: AlphaUse) {
    for ((view, mask), header) in views.iter_mut().zip(masks).zip(headers) {
        if let PhotoSource::Files { mask: path, alpha, .. } = &mut view.source {
            *alpha = if header.alpha { alpha_use } else { AlphaUse::Kept };
            view.mask_meaning = mask.as_ref().map_or(MaskMeaning::Keep, |m| m.meaning);
            *path = mask.map(|m| m.path);
        }
    }
}

/// Takes what bars leave of the photographs for these; a word about bars, or about corners of which no mask tells.
fn without_bars(looks: &mut [Look], on_border: &mut [Option<MaskLook>]) -> Option<Problem> {
    let Some(bars) = bars::bars(looks) else {
        let are_masked = on_border.iter().any(Option::is_some);
        return if are_masked { None } else { bars::corners(looks) };
    };
    looks.iter_mut().for_each(|look| look.border = bars.inner_border(look));
    on_border.fill_with(|| None);
    Some(bars.problem)
}

/// The checked cameras of a parsed dataset, whether their images exist or not.
pub(crate) fn named_cameras(
    path: &Path,
    parsed: ParsedDataset,
    options: &OpenOptions,
) -> Result<Vec<NamedCamera>, DataError> {
    if parsed.frames.is_empty() {
        return Err(DataError::NoCameras { path: path.to_owned() });
    }
    losses::refuse_lost(path, &parsed.frames)?;
    let stem = |f: &Frame| {
        let file = f.file.replace('\\', "/");
        Path::new(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned()
    };
    let stems: Vec<String> = parsed.frames.iter().map(stem).collect();
    let unique = stems.iter().collect::<HashSet<_>>().len() == stems.len();
    let sizes = sizes(&parsed, options)?;
    let named = parsed.frames.iter().zip(&stems).zip(sizes).map(|((frame, stem), size)| {
        let file = frame.file.replace('\\', "/");
        let folders = Path::new(file.trim_start_matches("./")).with_file_name(stem);
        let long = folders.to_string_lossy().replace('/', "_");
        let camera = camera_of(frame, size)?;
        Ok(NamedCamera { name: if unique { stem.clone() } else { long }, camera })
    });
    named.collect()
}

/// The camera of a frame whose image has this size, or else the stated one.
fn camera_of(frame: &Frame, found: Option<Size>) -> Result<Camera, DataError> {
    let Origin { path, key } = &frame.origin;
    let fault = |fault| DataError::Pose { path: path.to_path_buf(), key: key.clone(), fault };
    let pose = pose::check(&frame.pose).map_err(fault)?.pose;
    let stated =
        frame.intrinsics.size.map(|[w, h]| Size { width: w.round() as u32, height: h.round() as u32 });
    let size = found.or(stated).ok_or_else(|| {
        let (path, key) = (path.to_path_buf(), format!("{key}.w"));
        let expected = "w and h [pixel], because the image itself does not exist";
        DataError::Value { path, key, found: "missing".into(), expected }
    })?;
    frame.intrinsics.camera(size, pose, &frame.origin)
}

/// The sizes of the images that exist, as their poses mean them.
fn sizes(parsed: &ParsedDataset, options: &OpenOptions) -> Result<Vec<Option<Size>>, DataError> {
    let existing = || parsed.frames.iter().filter_map(|frame| Some((frame, frame.image.as_ref()?)));
    let headers = existing().map(|(_, image)| losses::header(image));
    let headers: Vec<Header> = headers.collect::<Result<_, DataError>>()?;
    let pictures: Vec<Picture> = existing().map(|(frame, _)| frame).zip(&headers).collect();
    let (orientations, _) = orientation::decide(parsed, &pictures, options.orientation)?;
    let mut found = pictures.iter().zip(orientations).map(|((_, header), of)| size(header, of));
    Ok(parsed.frames.iter().map(|frame| frame.image.as_ref().and_then(|_| found.next())).collect())
}

/// The size of the pixels that are meant.
fn size(header: &Header, orientation: Orientation) -> Size {
    match orientation {
        Orientation::Stored => header.stored,
        Orientation::Upright => header.upright(),
    }
}

/// A note about colour profiles other than sRGB; a warning where pictures differ.
fn profiles(headers: &[Header]) -> Option<Problem> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    headers
        .iter()
        .filter_map(|h| h.profile.as_deref())
        .for_each(|name| *counts.entry(name).or_default() += 1);
    let named: Vec<String> = counts.iter().map(|(name, n)| format!("{n} have {name}")).collect();
    let with = counts.values().sum::<usize>();
    let message = format!(
        "{with} of {} images have a colour profile other than sRGB ({}); their values are read as those of sRGB, so colours \
         look paler or stronger than in programs that obey profiles",
        headers.len(),
        named.join(", ")
    );
    match counts.len() {
        0 => None,
        1 if with == headers.len() => Some(Problem::note(message)),
        _ => Some(Problem::warning(format!("{message}, and pictures differ in it: convert all to sRGB"))),
    }
}

/// A warning about pictures without colours among others.
fn grey(headers: &[Header]) -> Option<Problem> {
    let grey = headers.iter().filter(|header| !header.coloured).count();
    let of = headers.len();
    (0 < grey && grey < of).then(|| {
        Problem::warning(format!(
            "{grey} of {of} images are stored without colours, and the others with them: a scene that has colours cannot show both; convert \
             all, or leave some out"
        ))
    })
}

fn differs(stated: [f64; 2], real: Size) -> bool {
    (stated[0] - f64::from(real.width)).abs() > 0.5 || (stated[1] - f64::from(real.height)).abs() > 0.5
}

/// An image that has another size than its camera states.
struct Resized {
    stated: [f64; 2],
    real: Size,
}

/// A note or warning about all such images.
fn resizes(resized: &[Resized]) -> Option<Problem> {
    let Resized { stated: [w, h], real } = resized.first()?;
    let count = resized.len();
    let message = format!(
        "{count} images have another size than their camera states ({w}x{h} stated, {real} found first); focal length and \
         principal point were scaled to the image"
    );
    let stretch = (f64::from(real.width) / w) / (f64::from(real.height) / h);
    let same_shape = (stretch - 1.0).abs() < 0.01;
    Some(if same_shape {
        Problem::note(message)
    } else {
        Problem::warning(format!(
            "{message}; the shape differs too: that is right only if the images were stretched; if they were cropped, export cameras for \
             these images, or take the whole ones"
        ))
    })
}

/// A warning about cameras that state no size and whose principal point is the middle of larger or smaller pictures.
fn of_other_pictures(implied: &[Resized]) -> Option<Problem> {
    let Resized { stated: [w, h], real } = implied.first()?;
    Some(Problem::warning(format!(
        "{} cameras state no size of their pictures, and their principal point is the middle of pictures of {w:.0}x{h:.0}, not of {real}: \
         focal length and principal point were scaled to the image",
        implied.len()
    )))
}

fn check_distinct_poses(path: &Path, data: &mut Dataset) -> Result<(), DataError> {
    match coincidence(data.views.iter().map(|view| &view.camera)) {
        Some(Coincidence::Pose) => {
            return Err(DataError::SamePose { path: path.to_owned(), count: data.views.len() });
        }
        Some(Coincidence::Place) => data.problems.push(one_place()),
        None => {}
    }
    Ok(())
}

/// Names each view by its image file; where folders hold files of one name, the folders join the name.
fn names(frames: &[Frame]) -> Vec<String> {
    let file = |frame: &Frame| {
        let name = frame.image.as_deref().and_then(Path::file_name);
        name.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let keys: Vec<_> = frames.iter().map(|f| (f.part, file(f))).collect();
    let mut count: HashMap<_, usize> = HashMap::new();
    for key in &keys {
        *count.entry(key).or_default() += 1;
    }
    let with_folders = |f: &Frame| {
        f.file.replace('\\', "/").replace(':', "").trim_start_matches(['.', '/']).replace('/', "_")
    };
    let named = frames.iter().zip(&keys);
    named.map(|(f, key)| if count[key] == 1 { key.1.clone() } else { with_folders(f) }).collect()
}

/// `scene.json` beside the data; what is wrong with it is only a warning.
fn truth(parsed: &mut ParsedDataset) -> Option<Value> {
    let file = parsed.root.folder().join("scene.json");
    if !file.is_file() || !parsed.root.contains(&file) {
        return None;
    }
    let read = json::read(&file);
    let warning = |what: &str, error| Problem::warning(format!("{what}: {error}"));
    let truth = read.map_err(|error| parsed.problems.push(warning("the truth is not used", error))).ok()?;
    let is_refractive = IndexTruth::listed(&truth) > 0;
    if let Some(error) = IndexTruth::parse(&file, &truth).err().filter(|_| is_refractive) {
        parsed.problems.push(warning("errors of the index will not be measured", error));
    }
    Some(truth)
}
