use super::envelope::{MAGIC, header_crc};
use super::*;
use half::f16;
use proptest::prelude::*;
use serde_json::json;
use std::path::Path;

fn example() -> TensorFile {
    let tensor = |shape: &[usize], data| Tensor::new(shape.to_vec(), data);
    let reals = [0.0, -1.5, f32::MIN_POSITIVE, 3.25, f32::INFINITY, 7.0].to_vec();
    let tensors = [
        ("density", tensor(&[2, 3], TensorData::F32(reals.into()))),
        ("colour", tensor(&[1, 2], TensorData::F16(vec![f16::from_f32(0.1), f16::MAX].into()))),
        ("flags", tensor(&[5], TensorData::U8(vec![1, 0, 1, 255, 9].into()))),
        ("index", tensor(&[2, 1], TensorData::U32(vec![u32::MAX, 4].into()))),
        ("nothing", tensor(&[0, 4], TensorData::F32(Vec::new().into()))),
        ("random \"state\" ü", tensor(&[], TensorData::U64(vec![u64::MAX - 1].into()))),
    ];
    TensorFile {
        header: json!({"step": 1200, "rate": 0.1 + 0.2, "note": "\"header_crc32\":\"00000000\"", "seeds": [1, u64::MAX]}),
        tensors: tensors.into_iter().map(|(name, t)| (name.to_owned(), t)).collect(),
    }
}

fn saved(file: &TensorFile) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("example.safetensors");
    file.save(&path).unwrap();
    std::fs::read(path).unwrap()
}

/// Without a file, of which the tests of damage would else write thousands.
fn load_bytes(bytes: &[u8]) -> Result<TensorFile, CheckpointError> {
    TensorFile::read(bytes, Path::new("example.safetensors"))
}

/// Replaces part of the header by a text of the same length and repairs its checksum.
fn forged(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let end = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let text = std::str::from_utf8(&bytes[8..end]).unwrap();
    assert!(text.contains(from), "{text}");
    let mut text = text.replace(from, to).into_bytes();
    let sum = header_crc(&text);
    text[MAGIC.len()..MAGIC.len() + sum.len()].copy_from_slice(sum.as_bytes());
    [&bytes[..8], &text, &bytes[end..]].concat()
}

#[test]
fn load_returns_what_was_saved() {
    assert_eq!(load_bytes(&saved(&example())).unwrap(), example());
    let empty = TensorFile { header: json!(null), tensors: Default::default() };
    assert_eq!(load_bytes(&saved(&empty)).unwrap(), empty);
}

#[test]
fn a_tensor_of_several_parts_is_whole_or_refused_and_may_be_left_out() {
    let values: Vec<f32> = (0..3 << 20).map(|k| k as f32).collect();
    let large = Tensor::new(vec![3 << 20], TensorData::F32((&values).into()));
    let small = Tensor::new(vec![1], TensorData::U8(vec![7].into()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.safetensors");
    save(&path, &json!({"step": 3}), &[("large", &large), ("small", &small)]).unwrap();
    let read = TensorFile::load(&path).unwrap();
    assert!(read.tensors["large"] == large);
    let mut bytes = std::fs::read(&path).unwrap();
    assert!(load_bytes(&bytes).unwrap() == read);
    let last = bytes.len() - 5;
    bytes[last] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    assert!(matches!(TensorFile::load(&path), Err(CheckpointError::Damaged { .. })));
    let rest = TensorFile::load_without(&path, &["large"]).unwrap();
    assert_eq!((rest.tensors.len(), &rest.tensors["small"]), (1, &read.tensors["small"]));
    assert_eq!(TensorFile::load_header(&path).unwrap(), json!({"step": 3}));
}

#[test]
fn nan_payloads_survive() {
    let bits = 0x7fc0_1234;
    let data = vec![f32::from_bits(bits)];
    let file = tempfile::NamedTempFile::new().unwrap();
    save(file.path(), &json!({}), &[("x", &Tensor::new(vec![1], TensorData::F32(data.into())))]).unwrap();
    let TensorData::F32(back) = &TensorFile::load(file.path()).unwrap().tensors["x"].data else {
        panic!("an f32 tensor comes back as one")
    };
    assert_eq!(back[0].to_bits(), bits);
}

#[test]
fn rows_are_stored_without_their_padding_in_either_precision() {
    // More rows than are converted at once.
    let values: Vec<f32> =
        (0..3 * 5000).map(|k| if k % 3 == 2 { f32::NAN } else { 1e-3 * k as f32 }).collect();
    let kept: Vec<f32> = values.iter().copied().filter(|v| !v.is_nan()).collect();
    for half in [false, true] {
        let rows = TensorData::Rows(Rows { values: &values, stride: 3, kept: 2, half });
        let mut bytes = Vec::new();
        write(&mut bytes, &json!({}), &[("x", &Tensor::new(vec![5000, 2], rows))]).unwrap();
        let file = TensorFile::read(&bytes[..], Path::new("rows")).unwrap();
        let stored = match &file.tensors["x"].data {
            TensorData::F32(v) if !half => v.to_vec(),
            TensorData::F16(v) if half => v.iter().map(|v| v.to_f32()).collect(),
            other => panic!("{other:?}"),
        };
        let expected = kept.iter().map(|&v| if half { f16::from_f32(v).to_f32() } else { v });
        assert!(stored.iter().copied().eq(expected), "half: {half}");
    }
}

#[test]
fn equal_content_gives_equal_bytes_in_any_order() {
    let a = &Tensor::new(vec![2], TensorData::F32(vec![1.0, 2.0].into()));
    let b = &Tensor::new(vec![1], TensorData::U64(vec![3].into()));
    let bytes = |tensors: &[_]| {
        let file = tempfile::NamedTempFile::new().unwrap();
        save(file.path(), &json!({"k": 1}), tensors).unwrap();
        std::fs::read(file.path()).unwrap()
    };
    assert_eq!(bytes(&[("a", a), ("b", b)]), bytes(&[("b", b), ("a", a)]));
}

#[test]
fn any_safetensors_reader_opens_the_file() {
    let bytes = saved(&example());
    let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    assert_eq!(file.tensor("flags").unwrap().data(), [1, 0, 1, 255, 9]);
    assert_eq!(file.tensor("density").unwrap().shape(), [2, 3]);
}

#[test]
fn every_single_bit_flip_is_detected() {
    let bytes = saved(&example());
    for bit in 0..bytes.len() * 8 {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert!(load_bytes(&flipped).is_err(), "bit {bit} of {}", bytes.len() * 8);
    }
}

#[test]
fn every_truncation_is_detected() {
    let bytes = saved(&example());
    for length in 0..bytes.len() {
        let error = load_bytes(&bytes[..length]).expect_err("a part is not the whole");
        assert!(
            matches!(error, CheckpointError::Damaged { .. } | CheckpointError::Foreign { .. }),
            "{error}"
        );
    }
}

#[test]
fn appended_bytes_are_detected() {
    let bytes = [saved(&example()), vec![0]].concat();
    assert!(matches!(load_bytes(&bytes), Err(CheckpointError::Damaged { .. })));
}

#[test]
fn other_schema_is_named() {
    let bytes = forged(&saved(&example()), r#"\"schema\":2"#, r#"\"schema\":7"#);
    let error = load_bytes(&bytes).unwrap_err();
    assert!(matches!(error, CheckpointError::Schema { found: 7, .. }), "{error}");
    assert!(error.to_string().contains("schema 7"), "{error}");
}

#[test]
fn forged_header_with_a_valid_checksum_does_not_allocate_its_claims() {
    let bytes = saved(&example());
    for (from, to) in [
        (r#""shape":[2,3]"#, r#""shape":[9e9]"#),
        (r#""shape":[2,3]"#, r#""shape":[999]"#),
        (r#""data_offsets":[8,32]"#, r#""data_offsets":[8,99]"#),
        (r#""dtype":"U32""#, r#""dtype":"I32""#),
        (r#""dtype":"U32""#, r#""dtype":"XXX""#),
        (r#"flags\":"#, r#"flagz\":"#),
    ] {
        let error = load_bytes(&forged(&bytes, from, to)).expect_err(to);
        assert!(matches!(error, CheckpointError::Damaged { .. }), "{to}: {error}");
    }
}

#[test]
fn header_length_beyond_the_file_allocates_nothing_absurd() {
    for length in [u64::MAX, 1 << 40, 99_999_999] {
        let mut bytes = saved(&example());
        bytes[..8].copy_from_slice(&length.to_le_bytes());
        assert!(matches!(load_bytes(&bytes), Err(CheckpointError::Damaged { .. })), "{length}");
    }
}

#[test]
fn other_files_are_foreign() {
    let foreign = safetensors::serialize(
        [("x", safetensors::tensor::TensorView::new(safetensors::Dtype::U8, vec![1], &[1]).unwrap())],
        None,
    )
    .unwrap();
    for bytes in [&b""[..], b"PNG", b"{\"step\": 1}\n and more text than a few bytes", &[0xff; 300], &foreign]
    {
        let error = load_bytes(bytes).unwrap_err();
        assert!(matches!(error, CheckpointError::Foreign { .. }), "{error}");
        assert!(error.to_string().contains("not a refraxel checkpoint"));
    }
    assert!(matches!(TensorFile::load(&std::env::temp_dir()), Err(CheckpointError::Foreign { .. })));
}

#[test]
fn missing_file_is_a_read_error_with_its_path() {
    let error = TensorFile::load(Path::new("/nowhere/run.safetensors")).unwrap_err();
    assert!(error.to_string().contains("/nowhere/run.safetensors"), "{error}");
    assert!(matches!(error, CheckpointError::Read { .. }));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(load_bytes(&bytes).is_err());
    }

    #[test]
    fn arbitrary_text_behind_a_valid_checksum_never_panics(tail in "[ -~]{0,80}") {
        let mut text = [MAGIC, b"00000000", tail.as_bytes()].concat();
        let sum = header_crc(&text);
        text[MAGIC.len()..MAGIC.len() + 8].copy_from_slice(sum.as_bytes());
        let bytes = [&(text.len() as u64).to_le_bytes()[..], &text].concat();
        prop_assert!(load_bytes(&bytes).is_err());
    }
}
