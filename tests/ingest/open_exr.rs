//! Domes whose OpenEXR says something of its own pixels: heeded, or refused.

use crate::files;
use candelabra::scene::{Category, Pixels, Scene};
use exr::meta::attribute::{Chromaticities, EnvironmentMap};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatImage, FlatSamples, Image, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, Vec2, WritableImage,
};
use serde_json::json;

fn plane(name: &str, width: usize, height: usize, value: f32) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, FlatSamples::F32(vec![value; width * height]))
}

fn picture(size: (usize, usize), channels: &[(&str, f32)]) -> FlatImage {
    let planes = channels.iter().map(|(name, value)| plane(name, size.0, size.1, *value));
    let layer = Layer::new(
        size,
        LayerAttributes::default(),
        Encoding::UNCOMPRESSED,
        AnyChannels::sort(planes.collect()),
    );
    Image::from_layers(ImageAttributes::new(IntegerBounds::from_dimensions(size)), vec![layer])
}

fn load(image: &FlatImage) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    image.write().to_file(folder.path().join("sky.exr")).unwrap();
    let mut file = files::lamp();
    file.lux(json!({"type": "DomeLight", "radiance": [1, 1, 1], "texture": "sky.exr"}));
    file.load_in(folder.path()).map_err(|error| error.to_string())
}

fn pixels(scene: &Scene) -> &[[f32; 3]] {
    let Pixels::Float(pixels) = &scene.textures[0].pixels else { panic!() };
    pixels
}

fn assert_near(pixel: [f32; 3], expected: [f32; 3]) {
    let near = pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3);
    assert!(near, "{pixel:?} is not {expected:?}");
}

#[test]
fn colours_are_brought_to_rec_709() {
    let aces = |channels: &[(&str, f32)]| {
        let mut image = picture((4, 2), channels);
        image.attributes.chromaticities = Some(Chromaticities {
            red: Vec2(0.7347, 0.2653),
            green: Vec2(0.0, 1.0),
            blue: Vec2(0.0001, -0.077),
            white: Vec2(0.32168, 0.33767),
        });
        load(&image).unwrap()
    };
    assert_near(pixels(&aces(&[("R", 0.5), ("G", 0.5), ("B", 0.5)]))[0], [0.5; 3]);
    // AP0 to Rec. 709 with Bradford's adaptation (colour-science).
    let expected = [0.1253, 0.3469, 0.0679];
    assert_near(pixels(&aces(&[("R", 0.2), ("G", 0.3), ("B", 0.1)]))[0], expected);
}

#[test]
fn one_channel_is_grey() {
    for name in ["Y", "R", "luminance"] {
        for alpha in [&[][..], &[("A", 0.5)]] {
            let channels = [&[(name, 0.25)], alpha].concat();
            assert_eq!(pixels(&load(&picture((4, 2), &channels)).unwrap())[5], [0.25; 3], "{name}");
        }
    }
}

#[test]
fn the_part_with_colours_is_read_whatever_stands_before_it() {
    let mut image = picture((4, 2), &[("depth", 9.0)]);
    image.layer_data.extend(picture((4, 2), &[("R", 1.0), ("G", 2.0), ("B", 3.0)]).layer_data);
    for (layer, name) in image.layer_data.iter_mut().zip(["depth", "beauty"]) {
        layer.attributes.layer_name = Some(name.into());
    }
    assert_eq!(pixels(&load(&image).unwrap())[0], [1.0, 2.0, 3.0]);
}

#[test]
fn the_display_window_is_the_picture() {
    let mut image = picture((4, 2), &[("R", 1.0), ("G", 1.0), ("B", 1.0)]);
    image.attributes.display_window = IntegerBounds::new((-1, -1), (8, 4));
    image.layer_data[0].attributes.layer_position = Vec2(1, 0);
    let scene = load(&image).unwrap();
    assert_eq!((scene.textures[0].width, scene.textures[0].height), (8, 4));
    let lit: Vec<usize> = (0..32).filter(|at| pixels(&scene)[*at] == [1.0; 3]).collect();
    assert_eq!(lit, [10, 11, 12, 13, 18, 19, 20, 21]);
    // A data window that is larger is cut.
    image.attributes.display_window = IntegerBounds::new((2, 1), (2, 1));
    let scene = load(&image).unwrap();
    assert_eq!(pixels(&scene), [[1.0; 3]; 2]);
}

#[test]
fn what_is_no_flat_picture_is_left_out_by_name() {
    let rgb = [("R", 1.0), ("G", 1.0), ("B", 1.0)];
    let mut cube = picture((2, 12), &rgb);
    cube.layer_data[0].attributes.environment_map = Some(EnvironmentMap::Cube);
    let mut colourless = picture((4, 2), &rgb);
    let same = Vec2(0.3, 0.3);
    colourless.attributes.chromaticities =
        Some(Chromaticities { red: same, green: same, blue: same, white: same });
    let cases = [
        (cube, "is a cube map"),
        (colourless, "chromaticities that span no colours"),
        (picture((4, 2), &[("Y", 1.0), ("RY", 0.0), ("BY", 0.0)]), "luminance and chroma"),
        (picture((4, 2), &[("beauty.R", 1.0), ("Z", 1.0)]), "its channels are Z, beauty.R"),
    ];
    for (image, problem) in cases {
        let scene = load(&image).unwrap();
        let note = &scene.notes[0];
        assert!(note.text.contains(problem) && note.text.contains("left out"), "{note:?}");
        assert!(note.category == Category::Lights && scene.lights.is_empty());
    }
}
