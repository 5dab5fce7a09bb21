//! Binary glTF 2.0: one mesh, node and material per region and for what is opaque, and cameras, below a node that turns the
//! world to y up.
//!
//! Sources: Khronos glTF 2.0, KHR_materials_ior, KHR_materials_transmission, KHR_materials_volume, KHR_materials_unlit.

use super::opaque::Opaque;
use super::surfaces::{Numbered, narrow};
use super::surroundings::{Point, Surroundings};
use super::up::Up;
use refraxel_core::{Camera, Mesh, Vec3};
use refraxel_data::{LocalOrigin, srgb_decode};
use refraxel_train::model::surface::Surface;
use serde_json::{Value, json};
use std::io::{self, Write};

const VERSION: u32 = 2;
const JSON_CHUNK: &[u8; 4] = b"JSON";
const BINARY_CHUNK: &[u8; 4] = b"BIN\0";
// Numbers of the standard.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
const POINTS: u32 = 0;
/// Near plane of cameras in their distance to the origin of the world, which only programs that need one use.
const NEAR: f64 = 1e-3;

/// Writes everything into one `.glb`. Vertices stay in world coordinates, whose upward direction is `up`, relative to `origin`: they
/// are in single precision, and the root node moves them there.
pub fn write(
    surfaces: &[Numbered],
    opaque: Option<&Opaque>,
    around: &Surroundings,
    up: &Up,
    origin: LocalOrigin,
    out: &mut dyn Write,
) -> io::Result<()> {
    let (mut binary, mut content) = (Vec::new(), Content { origin, ..Content::default() });
    if let Some(opaque) = opaque {
        content.add_opaque(opaque, &mut binary);
    }
    surfaces.iter().for_each(|s| content.add(s, &mut binary));
    if !around.points.is_empty() {
        content.add_points(&around.points, &mut binary);
    }
    around.cameras.iter().for_each(|(name, camera)| content.add_camera(name, camera));
    let mut text = serde_json::to_vec(&content.document(up, binary.len()))?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunks = [(JSON_CHUNK, &text), (BINARY_CHUNK, &binary)];
    let length = 12 + chunks.iter().map(|(_, data)| 8 + data.len()).sum::<usize>();
    let too_long = |_| io::Error::other("the mesh exceeds the 4 GiB of a .glb file; export less --detail");
    let length = u32::try_from(length).map_err(too_long)?;
    out.write_all(b"glTF")?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&length.to_le_bytes())?;
    for (kind, data) in chunks {
        out.write_all(&(data.len() as u32).to_le_bytes())?;
        out.write_all(kind)?;
        out.write_all(data)?;
    }
    Ok(())
}

/// The lists of the document.
#[derive(Default)]
struct Content {
    origin: LocalOrigin,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    cameras: Vec<Value>,
}

impl Content {
    /// Appends the numbers of a surface to `binary` and describes them.
    fn add(&mut self, Numbered { region, surface }: &Numbered, binary: &mut Vec<u8>) {
        let (mesh, k) = (&surface.mesh, self.meshes.len());
        let first = self.put_mesh(mesh, binary);
        let own = self.materials.len();
        self.materials.push(material(*region, surface, 4.0 * mesh.volume() / mesh.area()));
        self.meshes.push(json!({
            "name": format!("region {region}"),
            "primitives": [{
                "attributes": { "POSITION": first, "NORMAL": first + 1 },
                "indices": first + 2,
                "material": own,
            }],
        }));
        self.nodes.push(json!({ "name": format!("region {region}"), "mesh": k }));
    }

    /// Adds positions, normals and triangles, and returns the number of the first of these three.
    fn put_mesh(&mut self, mesh: &Mesh, binary: &mut Vec<u8>) -> usize {
        let first = self.accessors.len();
        self.put_positions(mesh.vertices.iter().map(|&x| self.local(x)).collect(), binary);
        self.put_vectors(mesh.normals.iter().map(|&n| narrow(n)).collect(), binary);
        let indices = mesh.triangles.as_flattened();
        let scalar = json!({ "componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR" });
        let indices = indices.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.put(scalar, ELEMENT_ARRAY_BUFFER, indices, binary);
        first
    }

    /// Appends the mesh of what is opaque. Its colours are those of photographs, which no lamp lights again.
    fn add_opaque(&mut self, opaque: &Opaque, binary: &mut Vec<u8>) {
        let k = self.meshes.len();
        let first = self.put_mesh(&opaque.mesh, binary);
        self.put_vectors(opaque.colours.iter().map(|c| c.map(light)).collect(), binary);
        self.meshes.push(json!({
            "name": "opaque",
            "primitives": [{
                "attributes": { "POSITION": first, "NORMAL": first + 1, "COLOR_0": first + 3 },
                "indices": first + 2,
                "material": self.materials.len(),
            }],
        }));
        self.materials.push(json!({
            "name": "opaque",
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            "extensions": { "KHR_materials_unlit": {} },
        }));
        self.nodes.push(json!({ "name": "opaque", "mesh": k }));
    }

    /// Appends opaque points with their colours, which are light in glTF.
    fn add_points(&mut self, points: &[Point], binary: &mut Vec<u8>) {
        let (first, k) = (self.accessors.len(), self.meshes.len());
        self.put_positions(points.iter().map(|p| self.local(p.place)).collect(), binary);
        self.put_vectors(points.iter().map(|p| p.colour.map(light)).collect(), binary);
        let material = self.materials.len();
        self.materials.push(json!({
            "name": "points", "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
        }));
        self.meshes.push(json!({
            "name": "opaque things",
            "primitives": [{
                "mode": POINTS, "attributes": { "POSITION": first, "COLOR_0": first + 1 }, "material": material,
            }],
        }));
        self.nodes.push(json!({ "name": "opaque things", "mesh": k }));
    }

    /// Appends the camera of a photograph, which looks along −z with y up there. Distortion and a shifted centre have no place
    /// in glTF.
    fn add_camera(&mut self, name: &str, camera: &Camera) {
        let pose = self.origin.to_local(*camera).world_from_camera;
        let [right, down, forward] = pose.rotation.columns;
        let column = |v: Vec3<f64>, w: f64| [v.x, v.y, v.z, w];
        let matrix =
            [column(right, 0.0), column(-down, 0.0), column(-forward, 0.0), column(pose.translation, 1.0)];
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        self.nodes.push(json!({ "name": name, "camera": self.cameras.len(), "matrix": matrix.concat() }));
        self.cameras.push(json!({
            "name": name,
            "type": "perspective",
            "perspective": {
                "yfov": 2.0 * (0.5 * height / camera.focal[1]).atan(),
                "aspectRatio": width * camera.focal[1] / (height * camera.focal[0]),
                "znear": NEAR * pose.translation.length().max(NEAR),
            },
        }));
    }

    /// A place as vertices state it.
    fn local(&self, x: Vec3<f64>) -> [f32; 3] {
        narrow(self.origin.to_local(x))
    }

    /// Adds positions, with the box around them.
    fn put_positions(&mut self, positions: Vec<[f32; 3]>, binary: &mut Vec<u8>) {
        let extreme = |best: fn(f32, f32) -> f32| {
            positions.iter().copied().reduce(|a, b| [0, 1, 2].map(|i| best(a[i], b[i])))
        };
        let (min, max) = (extreme(f32::min), extreme(f32::max));
        self.put_vectors(positions, binary);
        let accessor = self.accessors.last_mut().unwrap_or_else(|| unreachable!("it was just added"));
        (accessor["min"], accessor["max"]) = (json!(min), json!(max));
    }

    fn put_vectors(&mut self, vectors: Vec<[f32; 3]>, binary: &mut Vec<u8>) {
        let accessor = json!({ "componentType": FLOAT, "count": vectors.len(), "type": "VEC3" });
        let bytes = vectors.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        self.put(accessor, ARRAY_BUFFER, bytes, binary);
    }

    /// Adds one array: its bytes, their place and their meaning. All numbers have 4 bytes, so that none is misaligned.
    fn put(&mut self, mut accessor: Value, target: u32, bytes: Vec<u8>, binary: &mut Vec<u8>) {
        let view = self.views.len();
        self.views.push(json!({
            "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len(), "target": target,
        }));
        binary.extend(bytes);
        accessor["bufferView"] = json!(view);
        self.accessors.push(accessor);
    }

    /// The document around `length` bytes of numbers. The nodes of the regions come first, their parent last.
    fn document(mut self, up: &Up, length: usize) -> Value {
        let root = self.nodes.len();
        let mut world = json!({
            "name": "world, turned to y up",
            "rotation": up.rotation_to_y(),
            "children": (0..root).collect::<Vec<_>>(),
        });
        if !self.origin.is_of_world() {
            world["translation"] = json!(up.turned_to_y(self.origin.place()).to_array());
        }
        self.nodes.push(world);
        let mut document = json!({
            "asset": {
                "version": "2.0",
                "generator": concat!("refraxel ", env!("CARGO_PKG_VERSION")),
                "extras": {
                    "coordinates": "vertices are in the world coordinates of the dataset; the root node turns `up`, \
                                    the upward direction there, to +y",
                    "order": "where bodies overlap, the medium of the higher region number is there",
                    "up": up.direction.to_array(),
                    "up_note": up.note.as_deref().unwrap_or("mean upward direction of the cameras"),
                },
            },
            "extensionsUsed": ["KHR_materials_transmission", "KHR_materials_ior", "KHR_materials_volume", "KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{ "nodes": [root] }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": length }],
        });
        if !self.origin.is_of_world() {
            let extras = &mut document["asset"]["extras"];
            extras["coordinates"] = json!(
                "vertices are relative to `origin`, a point of the world coordinates of the dataset; the root node moves them \
                 there and turns `up`, the upward direction there, to +y"
            );
            extras["origin"] = json!(self.origin.place().to_array());
        }
        if !self.cameras.is_empty() {
            document["cameras"] = json!(self.cameras); // an empty list is not allowed
        }
        document
    }
}

/// Light of an sRGB code, of which what lies outside of [0, 1] is cut off.
fn light(code: f32) -> f32 {
    srgb_decode(code.clamp(0.0, 1.0))
}

/// Smooth glass, clear or tinted.
///
/// `thickness` [scene unit] is the mean chord of the body; renderers without rays shift the background by it. For a convex
/// body it is 4 volume / area (Cauchy). Over the distance d white light becomes the attenuation colour c, T(x) = c^(x/d):
/// with d the thickness, c = e^(−α d) of theory (7.17) is the colour that the body shows. Both are of linear light.
fn material(region: usize, surface: &Surface, thickness: f64) -> Value {
    let (index, tint) = (surface.index, surface.absorption);
    let mut material = json!({
        "name": format!("n = {index:.3}, region {region}"),
        "pbrMetallicRoughness": {
            "baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.0,
        },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1.0 },
            "KHR_materials_volume": { "thicknessFactor": thickness },
        },
        "extras": { "index": index },
    });
    if tint != [0.0; 3] {
        let volume = &mut material["extensions"]["KHR_materials_volume"];
        volume["attenuationDistance"] = json!(thickness);
        volume["attenuationColor"] = json!(tint.map(|a| (-f64::from(a) * thickness).exp()));
    }
    // The extension allows no index below 1.
    if index >= 1.0 {
        material["extensions"]["KHR_materials_ior"] = json!({ "ior": index });
    }
    material
}

#[cfg(test)]
mod tests {
    use super::super::surfaces::ball_and_shell;
    use super::*;
    use gltf::Glb;
    use refraxel_core::vec3;

    const Z_UP: Up = Up { direction: vec3(0.0, 0.0, 1.0), note: None };

    fn written(up: &Up) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(&ball_and_shell(), None, &Surroundings::default(), up, LocalOrigin::default(), &mut bytes)
            .unwrap();
        bytes
    }

    #[test]
    fn the_nodes_turn_the_up_of_the_world_to_y_and_leave_the_rest_to_the_viewer() {
        let slanted = Up { direction: vec3(0.1, -0.7, 0.4).normalized(), note: None };
        for up in [Z_UP, slanted] {
            let document = gltf::Gltf::from_slice(&written(&up)).unwrap();
            let roots: Vec<_> = document.default_scene().unwrap().nodes().collect();
            assert_eq!((roots.len(), roots[0].children().count()), (1, 2));
            // Columns of the matrix that takes the world to the scene.
            let m = roots[0].transform().matrix();
            let d = up.direction.cast::<f32>().to_array();
            let turned = [0, 1, 2, 3].map(|row| (0..3).map(|c| m[c][row] * d[c]).sum::<f32>());
            for (found, expected) in turned.iter().zip([0.0, 1.0, 0.0, 0.0]) {
                assert!((found - expected).abs() < 1e-6, "{turned:?}"); // a few f32 eps
            }
            assert_eq!(m[3], [0.0, 0.0, 0.0, 1.0]);
        }
    }

    #[test]
    fn a_world_with_z_up_gets_the_exact_quarter_turn() {
        let json: Value = serde_json::from_slice(&Glb::from_slice(&written(&Z_UP)).unwrap().json).unwrap();
        let half = 0.5_f64.sqrt();
        assert_eq!(json["nodes"][2]["rotation"], json!([-half, 0.0, 0.0, half]));
        let extras = &json["asset"]["extras"];
        assert_eq!(extras["up"], json!([0.0, 0.0, 1.0]));
        assert!(extras["coordinates"].as_str().unwrap().contains("world coordinates of the dataset"));
        assert!((json["materials"][0]["extras"]["index"].as_f64().unwrap() - 1.5).abs() < 1e-6);
    }

    #[test]
    fn an_independent_reader_finds_glass_in_the_world() {
        let (surfaces, bytes) = (ball_and_shell(), written(&Z_UP));
        // Validates the document against the standard: indices, required fields, extensions.
        let document = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = document.blob.as_deref().unwrap();
        let root = document.default_scene().unwrap().nodes().next().unwrap();
        let nodes: Vec<_> = root.children().collect();
        assert_eq!((nodes.len(), document.buffers().next().unwrap().length()), (2, blob.len()));
        for (node, Numbered { region, surface }) in nodes.iter().zip(&surfaces) {
            assert_eq!(node.name(), Some(format!("region {region}").as_str()));
            let (translation, rotation, scale) = node.transform().decomposed();
            assert_eq!((translation, rotation, scale), ([0.0; 3], [0.0, 0.0, 0.0, 1.0], [1.0; 3]));
            let primitive = node.mesh().unwrap().primitives().next().unwrap();
            let reader = primitive.reader(|_| Some(blob));
            let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
            let normals: Vec<[f32; 3]> = reader.read_normals().unwrap().collect();
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            let mesh = &surface.mesh;
            assert_eq!(indices, mesh.triangles.as_flattened());
            assert_eq!(positions, mesh.vertices.iter().map(|&x| narrow(x)).collect::<Vec<_>>());
            assert_eq!(normals, mesh.normals.iter().map(|&n| narrow(n)).collect::<Vec<_>>());
            let bounds = primitive.bounding_box();
            assert!(positions.iter().all(|x| (0..3).all(|a| bounds.min[a] <= x[a] && x[a] <= bounds.max[a])));
            let material = primitive.material();
            assert_eq!(material.ior(), Some(surface.index));
            assert_eq!(material.transmission().unwrap().transmission_factor(), 1.0);
            let volume = material.volume().unwrap();
            assert!(volume.thickness_factor() > 0.0);
            // T(x) = c^(x/d) after one scene unit.
            for (c, a) in volume.attenuation_color().into_iter().zip(surface.absorption) {
                let transmitted = if a == 0.0 { 1.0 } else { c.powf(volume.attenuation_distance().recip()) };
                assert!((transmitted - (-a).exp()).abs() < 1e-5, "{c} {a}");
                assert!(a > 0.0 || c == 1.0);
            }
        }
    }

    #[test]
    fn chunks_and_arrays_are_aligned_as_the_standard_asks() {
        let bytes = written(&Z_UP);
        let glb = Glb::from_slice(&bytes).unwrap();
        assert_eq!((glb.header.length as usize, bytes.len() % 4), (bytes.len(), 0));
        assert_eq!((glb.json.len() % 4, glb.bin.unwrap().len() % 4), (0, 0));
        let json: Value = serde_json::from_slice(&glb.json).unwrap();
        let views = json["bufferViews"].as_array().unwrap();
        assert!(views.iter().all(|v| v["byteOffset"].as_u64().unwrap().is_multiple_of(4)));
    }

    #[test]
    fn points_and_cameras_stand_where_they_were() {
        let eye = vec3(3.0, -1.0, 2.0);
        let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [80, 60]);
        let point = Point { place: vec3(0.1, 0.2, 0.3), colour: [1.0, 0.5, 0.0] };
        let around = Surroundings { points: vec![point], cameras: vec![("a.png".to_owned(), camera)] };
        let mut bytes = Vec::new();
        write(&[], None, &around, &Z_UP, LocalOrigin::default(), &mut bytes).unwrap();
        let document = gltf::Gltf::from_slice(&bytes).unwrap();
        let root = document.default_scene().unwrap().nodes().next().unwrap();
        let nodes: Vec<_> = root.children().collect();
        let [points, seen] = &nodes[..] else { panic!("two nodes") };
        let primitive = points.mesh().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|_| document.blob.as_deref());
        assert_eq!(reader.read_positions().unwrap().collect::<Vec<_>>(), [[0.1, 0.2, 0.3]]);
        let colour = reader.read_colors(0).unwrap().into_rgb_f32().next().unwrap();
        assert!((colour[1] - 0.214_041).abs() < 1e-5 && colour[0] == 1.0, "{colour:?}");
        let camera = seen.camera().unwrap();
        let gltf::camera::Projection::Perspective(lens) = camera.projection() else { panic!() };
        assert!((lens.aspect_ratio().unwrap() - 80.0 / 60.0).abs() < 1e-5);
        assert!((f64::from(lens.yfov()) - 2.0 * (0.75 * 0.35_f64.tan()).atan()).abs() < 1e-5);
        // It looks along −z, at the origin of the world.
        let m = seen.transform().matrix().map(|c| vec3(c[0], c[1], c[2]).cast::<f64>());
        assert!((m[3] - eye).length() < 1e-5 && (m[2] - eye.normalized()).length() < 1e-5);
        assert!(m[1].z > 0.5, "y is up");
    }

    #[test]
    fn what_is_far_away_is_moved_there_by_the_root_node() {
        let far = LocalOrigin::at(vec3(471_232.0, 5_270_144.0, 528.0));
        let mut surfaces = ball_and_shell();
        let around = |x: Vec3<f64>| {
            let camera = Camera::look_at(x + vec3(3.0, 0.0, 0.0), x, vec3(0.0, 0.0, 1.0), 0.7, [80, 60]);
            let points = vec![Point { place: x, colour: [1.0; 3] }];
            Surroundings { points, cameras: vec![("a".to_owned(), camera)] }
        };
        let mut bytes = [Vec::new(), Vec::new()];
        write(&surfaces, None, &around(Vec3::zero()), &Z_UP, LocalOrigin::default(), &mut bytes[0]).unwrap();
        for surface in &mut surfaces {
            surface.surface.mesh.vertices.iter_mut().for_each(|x| *x = far.to_world(*x));
        }
        write(&surfaces, None, &around(far.place()), &Z_UP, far, &mut bytes[1]).unwrap();
        let [near, away] = bytes.each_ref().map(|bytes| Glb::from_slice(bytes).unwrap());
        let positions = |glb: &Glb| -> Vec<f32> {
            let bytes = glb.bin.as_ref().unwrap()[..1200].to_vec();
            bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
        };
        for (a, b) in positions(&near).into_iter().zip(positions(&away)) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        let [near, mut away]: [Value; 2] = [near, away].map(|glb| serde_json::from_slice(&glb.json).unwrap());
        let root = away["nodes"].as_array_mut().unwrap().last_mut().unwrap();
        let turned: Vec<f64> = serde_json::from_value(root["translation"].take()).unwrap();
        let expected = [471_232.0, 528.0, -5_270_144.0]; // z is up there, y is here
        assert!(turned.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{turned:?}");
        assert_eq!(away["asset"]["extras"]["origin"], json!([471_232.0, 5_270_144.0, 528.0]));
        assert_eq!(near["nodes"][3], away["nodes"][3], "cameras, too");
    }

    #[test]
    fn what_is_opaque_comes_first_with_colours_as_light_that_no_lamp_changes() {
        let mesh = ball_and_shell()[0].surface.mesh.clone();
        let colours = vec![[1.0, 0.5, 0.0]; mesh.vertices.len()];
        let opaque = Opaque { mesh, colours, level: 0.4, small: 0, unseen: 0, guessed: 0.0 };
        let mut bytes = Vec::new();
        write(
            &ball_and_shell(),
            Some(&opaque),
            &Surroundings::default(),
            &Z_UP,
            LocalOrigin::default(),
            &mut bytes,
        )
        .unwrap();
        let document = gltf::Gltf::from_slice(&bytes).unwrap();
        let names: Vec<_> = document.meshes().map(|m| m.name().unwrap().to_owned()).collect();
        assert_eq!(names, ["opaque", "region 1", "region 3"]);
        let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
        let json: Value = serde_json::from_slice(&Glb::from_slice(&bytes).unwrap().json).unwrap();
        assert!(json["materials"][0]["extensions"]["KHR_materials_unlit"].is_object());
        let reader = primitive.reader(|_| document.blob.as_deref());
        let colours: Vec<[f32; 3]> = reader.read_colors(0).unwrap().into_rgb_f32().collect();
        assert_eq!(colours.len(), reader.read_positions().unwrap().count());
        assert!(colours.iter().all(|c| c[0] == 1.0 && (c[1] - 0.214_041).abs() < 1e-5 && c[2] == 0.0));
        assert_eq!(reader.read_indices().unwrap().into_u32().count(), 3 * opaque.mesh.triangles.len());
        let glass = document.meshes().nth(1).unwrap().primitives().next().unwrap();
        assert_eq!(glass.material().ior(), Some(1.5));
    }

    #[test]
    fn a_bubble_has_no_index_below_one() {
        let mut bubble = ball_and_shell().remove(0).surface;
        bubble.index = 0.75;
        assert!(material(1, &bubble, 1.0)["extensions"].get("KHR_materials_ior").is_none());
    }
}
