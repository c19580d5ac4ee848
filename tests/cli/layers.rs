//! `--aov`, `--light-group`, `--crop`: what a picture has, and of which part.

use crate::files::Shot;
use exr::meta::MetaData;
use exr::meta::attribute::IntegerBounds;
use serde_json::json;

fn header(shot: &Shot, name: &str) -> exr::meta::header::Header {
    MetaData::read_from_file(shot.path(name), true).unwrap().headers[0].clone()
}

fn channels(shot: &Shot, name: &str) -> Vec<String> {
    header(shot, name).channels.list.iter().map(|channel| channel.name.to_string()).collect()
}

#[test]
fn a_picture_has_the_layers_that_are_asked_for() {
    let mut shot = Shot::still();
    shot.render("-o plain.exr").ends(0);
    let usual = [
        "A",
        "B",
        "G",
        "N.X",
        "N.Y",
        "N.Z",
        "R",
        "Z",
        "albedo.B",
        "albedo.G",
        "albedo.R",
        "sampleCount",
        "variance.B",
        "variance.G",
        "variance.R",
    ];
    assert_eq!(channels(&shot, "plain.exr"), usual);
    shot.render("-o few.exr --aov depth,emission --aov position").ends(0);
    let few =
        ["A", "B", "G", "P.X", "P.Y", "P.Z", "R", "Z", "emission.B", "emission.G", "emission.R"];
    assert_eq!(channels(&shot, "few.exr"), few);
    let groups = |shot: &Shot, name: &str| {
        let all = channels(shot, name).into_iter();
        all.filter(|name| name.starts_with("RGBA_") && name.ends_with(".R")).collect::<Vec<_>>()
    };
    shot.render("-o groups.exr --light-group key=/l*p").ends(0);
    assert_eq!(groups(&shot, "groups.exr"), ["RGBA_default.R", "RGBA_key.R"]);
    shot.edit(|json| {
        json["nodes"][1]["extras"] = json!({"usdLux": {"type": "MeshLight", "group": "rim left"}});
    });
    shot.render("-o own.exr --aov light-groups").ends(0);
    assert_eq!(groups(&shot, "own.exr"), ["RGBA_default.R", "RGBA_rim_left.R"]);
    let wrong = "-o wrong.exr --light-group key=/lamps";
    shot.render(wrong).ends(1).complains(&["/lamps", "'key'", "candelabra inspect"]);
    assert!(!shot.path("wrong.exr").exists());
}

#[test]
fn a_crop_is_a_part_of_the_picture_and_no_other_is_taken_for_it() {
    let shot = Shot::still();
    shot.render("-o a.exr --res 16x8 --crop 4 2 12 7 --png").ends(0);
    let header = header(&shot, "a.exr");
    assert_eq!(header.data_window(), IntegerBounds::new((4, 2), (8, 5)));
    assert_eq!(header.shared_attributes.display_window, IntegerBounds::new((0, 0), (16, 8)));
    assert_eq!(image::open(shot.path("a.png")).unwrap().into_rgb8().dimensions(), (8, 5));
    let resumed =
        |arguments: &str| shot.render(&format!("--resume --res 16x8 -o a.exr {arguments}")).ends(0);
    resumed("--crop 4 2 12 7 --png").says("up to date");
    // The beauty is written whether it is named or not, and the order of a list is no difference.
    let others = [
        "--crop 4 2 12 8",
        "",
        "--aov depth,motion",
        "--aov motion",
        "--light-group key=/lamp",
        "--light-group rim=/lamp",
        "--float",
    ];
    for other in others {
        resumed(other).keeps_quiet_about("up to date");
        resumed(other).says("up to date");
    }
    resumed("--aov motion,depth,motion").keeps_quiet_about("up to date");
    resumed("--aov beauty --aov depth,motion").says("up to date");
}
