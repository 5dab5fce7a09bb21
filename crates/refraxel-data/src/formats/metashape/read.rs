//! From the XML to a parsed dataset.

use super::chunk::Similarity;
use super::element::{Element, child};
use super::sensor;
use crate::folder::only_file;
use crate::formats::beside::{self, image_folder};
use crate::parsed::{Frame, Intrinsics, Origin, ParsedDataset};
use crate::root::{Root, Statement};
use crate::{DataError, Format, OpenOptions, Problem, limits, pose};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most elements, attributes and texts of a file.
const NODES: u32 = 5_000_000;

/// The file of cameras in a folder: XML with a `<document>` that has a `<chunk>`.
pub(crate) fn find(folder: &Path) -> Result<Option<PathBuf>, DataError> {
    only_file(folder, ".xml", is_cameras)
}

/// Whether a file has what cameras of Metashape have.
pub(crate) fn is_cameras(file: &Path) -> bool {
    limits::read_text(file)
        .is_ok_and(|text| ["<document", "<chunk", "<camera"].iter().all(|tag| text.contains(tag)))
}

/// An aligned camera.
struct Camera<'a> {
    node: Node<'a, 'a>,
    label: &'a str,
    place: String,
    component: Option<&'a str>,
}

/// Reads the chunk with the most aligned cameras; photographs are found by label.
pub(crate) fn read(file: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::beside(file, Format::Metashape, options)?;
    let text = limits::read_text(file)?;
    let parsing = ParsingOptions { nodes_limit: NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, parsing)
        .map_err(|source| DataError::Xml { path: file.to_owned(), source: Box::new(source) })?;
    let (chunk, cameras) = largest_chunk(file, &document, &mut parsed.problems)?;
    let cameras = largest_component(file, cameras, &mut parsed.problems);
    limits::frames(file, cameras.len())?;
    let world = world(&mut parsed, file, transform(file, chunk, cameras.first().and_then(|c| c.component))?);
    let sensors = sensors(file, chunk, &cameras, &mut parsed.problems)?;
    let images = image_folder(&parsed.root, cameras.iter().map(|c| c.label));
    let path = Arc::new(file.to_owned());
    for camera in &cameras {
        let frame = frame(&parsed.root, &images, camera, &sensors, path.clone())?;
        parsed.frames.push(Frame { pose: world.apply(&frame.pose), ..frame });
    }
    Ok(parsed)
}

/// The chunk with the most aligned cameras, and these.
fn largest_chunk<'a>(
    file: &Path,
    document: &'a Document<'a>,
    problems: &mut Vec<Problem>,
) -> Result<(Node<'a, 'a>, Vec<Camera<'a>>), DataError> {
    let chunks = document.root().descendants().filter(|node| node.has_tag_name("chunk"));
    let mut chunks: Vec<_> = chunks.map(|chunk| (chunk, aligned(chunk))).collect();
    let count = chunks.len();
    chunks.sort_by_key(|(_, (cameras, _))| std::cmp::Reverse(cameras.len()));
    let none = || DataError::NoCameras { path: file.to_owned() };
    let (chunk, (cameras, left_out)) = chunks.into_iter().next().ok_or_else(none)?;
    let first = cameras.first().ok_or_else(none)?;
    if count > 1 {
        let label = chunk.attribute("label").unwrap_or(first.label);
        problems.push(Problem::warning(format!(
            "{}: it has {count} chunks; the one with most aligned cameras ({label:?}, {}) is used; the others have other \
             coordinates",
            file.display(),
            cameras.len()
        )));
    }
    problems.extend(left_out.note(file, cameras.len()));
    Ok((chunk, cameras))
}

/// Cameras that are not used.
#[derive(Default)]
struct LeftOut {
    not_aligned: usize,
    disabled: usize,
}

impl LeftOut {
    fn note(&self, file: &Path, used: usize) -> Option<Problem> {
        let Self { not_aligned, disabled } = self;
        let total = used + not_aligned + disabled;
        (total > used).then(|| {
            let file = file.display();
            Problem::note(format!(
                "{file}: {used} of {total} cameras are used; {not_aligned} are not aligned, {disabled} are disabled"
            ))
        })
    }
}

/// The cameras of a chunk that have a pose and are not switched off, in groups or not.
fn aligned<'a>(chunk: Node<'a, 'a>) -> (Vec<Camera<'a>>, LeftOut) {
    let (mut cameras, mut left_out) = (Vec::new(), LeftOut::default());
    let Some(list) = child(chunk, "cameras") else { return (cameras, left_out) };
    for node in list.descendants().filter(|node| node.has_tag_name("camera")) {
        if child(node, "transform").is_none() {
            left_out.not_aligned += 1;
        } else if matches!(node.attribute("enabled"), Some("0" | "false")) {
            left_out.disabled += 1;
        } else {
            let label = node.attribute("label").unwrap_or_default();
            let place = format!("camera {} ({label})", node.attribute("id").unwrap_or("without id"));
            cameras.push(Camera { node, label, place, component: node.attribute("component_id") });
        }
    }
    (cameras, left_out)
}

/// The cameras of the component that has most of them.
fn largest_component<'a>(
    file: &Path,
    cameras: Vec<Camera<'a>>,
    problems: &mut Vec<Problem>,
) -> Vec<Camera<'a>> {
    let mut counts: BTreeMap<Option<&str>, usize> = BTreeMap::new();
    for camera in &cameras {
        *counts.entry(camera.component).or_default() += 1;
    }
    let largest = counts.iter().max_by_key(|(_, count)| **count).map(|(component, _)| *component);
    if counts.len() > 1 {
        problems.push(Problem::warning(format!(
            "{}: the cameras are in {} components, which are not aligned with each other; the largest is used",
            file.display(),
            counts.len()
        )));
    }
    cameras.into_iter().filter(|camera| Some(camera.component) == largest).collect()
}

/// From the chunk to the world, whose origin is near by; and the way up, where coordinates say it.
fn world(parsed: &mut ParsedDataset, file: &Path, stated: Similarity) -> Similarity {
    let Some(up) = stated.up_on_earth() else { return stated };
    parsed.up = Some(up);
    parsed.problems.push(Problem::note(format!(
        "{}: coordinates are counted from the centre of the earth; the scene has their axes and scale, and its own origin",
        file.display()
    )));
    stated.near_by()
}

/// The transform of a component, else that of its chunk.
fn transform(file: &Path, chunk: Node, component: Option<&str>) -> Result<Similarity, DataError> {
    let components = child(chunk, "components");
    let its = components.into_iter().flat_map(|list| list.children()).find(|node| {
        node.has_tag_name("component") && component.is_some() && node.attribute("id") == component
    });
    match its.filter(|node| child(*node, "transform").is_some()) {
        Some(node) => Similarity::of(file, "the transform of the component", node),
        None => Similarity::of(file, "the transform of the chunk", chunk),
    }
}

/// The intrinsics of the sensors that took the photographs, by id.
fn sensors<'a>(
    file: &Path,
    chunk: Node<'a, 'a>,
    cameras: &[Camera<'a>],
    problems: &mut Vec<Problem>,
) -> Result<HashMap<&'a str, Intrinsics>, DataError> {
    let mut sensors = HashMap::new();
    let used: HashSet<_> = cameras.iter().filter_map(|camera| camera.node.attribute("sensor_id")).collect();
    let list = child(chunk, "sensors").into_iter().flat_map(|list| list.children());
    for node in list.filter(|node| node.has_tag_name("sensor")) {
        let id = node.attribute("id").unwrap_or_default();
        if used.contains(id) {
            let place = format!("sensor {id}");
            let (intrinsics, left_out) = sensor::intrinsics(&Element { path: file, place: &place, node })?;
            sensors.insert(id, intrinsics);
            problems.extend(left_out);
        }
    }
    Ok(sensors)
}

/// The view of a camera, posed in its chunk.
fn frame(
    root: &Root,
    images: &str,
    camera: &Camera,
    sensors: &HashMap<&str, Intrinsics>,
    path: Arc<PathBuf>,
) -> Result<Frame, DataError> {
    const EXPECTED: &str = "sixteen finite numbers, row by row (camera to chunk)";
    let Camera { node, label, place, .. } = camera;
    let element = Element { path: &path, place, node: *node };
    let sensor = node.attribute("sensor_id").unwrap_or("missing");
    let intrinsics = *sensors
        .get(sensor)
        .ok_or_else(|| element.wrong("sensor_id", sensor, "the id of a sensor of the same chunk"))?;
    let matrix = element.numbers::<16>("transform", EXPECTED)?;
    let [a, b, c, ..] = *matrix.as_ref().map_or(&[[0.0; 4]; 4][..], |m| m.as_chunks::<4>().0) else {
        return Err(element.wrong("transform", "missing", EXPECTED));
    };
    let image = root.find_below(images, label, Statement { path: &path, key: place })?;
    let (pose, key) = (pose::from_opencv([a, b, c]), place.clone());
    Ok(beside::frame(Origin { path: path.clone(), key }, *label, image, intrinsics, pose))
}
