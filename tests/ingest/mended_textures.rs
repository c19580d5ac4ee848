//! Textures that are broken, or that a mesh cannot use: mended or left out, with one note.

use crate::files::{File, png};
use crate::mended::{mends, takes};
use candelabra::scene::Category::{self, Lights, Materials};
use serde_json::json;

type Damage = Box<dyn Fn(&mut File)>;

/// What stands in for a texture that cannot be read, whyever it cannot, is neutral.
#[test]
fn textures_that_cannot_be_read() {
    let good = png(64, 64, [1, 2, 3, 255]);
    // The header says 60,000 x 60,000; 30,000 x 30,000 would take more than 4 GiB while it is decoded.
    let bomb = |side: u32| {
        let mut bytes = good.clone();
        bytes[16..20].copy_from_slice(&side.to_be_bytes());
        bytes[20..24].copy_from_slice(&side.to_be_bytes());
        let checksum = crc32fast::hash(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
        bytes
    };
    let embedded = |bytes: Vec<u8>| {
        move |f: &mut File| {
            let view = f.view(&bytes);
            f.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
        }
    };
    let named = |uri: &'static str| {
        move |f: &mut File| {
            f.add("images", json!({"uri": uri}));
        }
    };
    let mut rgb = bomb(30_000);
    rgb[25] = 2;
    let checksum = crc32fast::hash(&rgb[12..29]);
    rgb[29..33].copy_from_slice(&checksum.to_be_bytes());
    let broken: Vec<(&str, Damage)> = vec![
        ("cannot be decoded", Box::new(embedded(good[..good.len() / 2].to_vec()))),
        ("60000 x 60000", Box::new(embedded(bomb(60_000)))),
        ("30000 x 30000", Box::new(embedded(rgb))),
        ("neither PNG nor JPEG", Box::new(embedded(b"RIFF\0\0\0\0WEBP".to_vec()))),
        ("cannot be read", Box::new(named("absent.png"))),
        ("absolute", Box::new(named("http://a/b.png"))),
        ("outside", Box::new(named("../b.png"))),
        ("base64", Box::new(named("data:image/png;base64,?"))),
        ("image 0: is not in the file", Box::new(|_: &mut File| {})),
        (
            "has no data",
            Box::new(|f: &mut File| {
                f.add("images", json!({}));
            }),
        ),
    ];
    for (text, image) in &broken {
        let textured = |category: Category, set: &dyn Fn(&mut serde_json::Value)| {
            let scene = mends(category, "material 0", text, |f| {
                image(f);
                f.add("textures", json!({"source": 0}));
                let uv = f.floats(&[0.0; 6], "VEC2");
                f.attribute("TEXCOORD_0", uv);
                set(&mut f.json["materials"][0]);
            });
            assert!(scene.textures.is_empty());
            scene.materials[0].clone()
        };
        let map = json!({"index": 0});
        let dark = textured(Lights, &|m| m["emissiveTexture"] = map.clone());
        assert!(!dark.emits(), "{text}");
        let grey = textured(Materials, &|m| {
            m["pbrMetallicRoughness"] = json!({"baseColorTexture": map});
        });
        assert_eq!((grey.base_color.to_array(), grey.emits()), ([0.5; 3], true));
        let dull = textured(Materials, &|m| {
            m["pbrMetallicRoughness"] = json!({"metallicRoughnessTexture": map});
        });
        assert_eq!((dull.metallic, dull.emits()), (0.0, true));
        assert!(textured(Materials, &|m| m["normalTexture"] = map.clone()).emits());
    }
    // What nobody uses costs nothing.
    for (_, image) in &broken {
        takes(|f| {
            image(f);
            f.add("textures", json!({"source": 0}));
            f.add("materials", json!({"normalTexture": {"index": 0}}));
        });
    }
    for texture in ["../sky.exr", "absent.hdr"] {
        let scene = mends(Lights, "dome texture", "the dome is left out", |f| {
            f.lux(json!({"type": "DomeLight", "radiance": [1, 1, 1], "texture": texture}));
        });
        assert!(scene.lights.is_empty());
    }
}

/// Without texture coordinates a texture shows its corner, as it does elsewhere; not white.
#[test]
fn a_mesh_without_texture_coordinates_has_one_colour() {
    let scene = mends(Lights, "mesh 0", "no TEXCOORD_0", |f| {
        let view = f.view(&png(2, 2, [128, 0, 0, 255]));
        f.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
        f.add("textures", json!({"source": 0}));
        f.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    });
    assert_eq!(scene.meshes[0].uv_sets[0].len(), scene.meshes[0].positions.len());
}
