//! `candelabra verify`.

use crate::files::{SCENE, Shot};

#[test]
fn it_says_of_each_file_what_it_is() {
    let shot = Shot::still();
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot.candelabra("verify shot.ltree")
        .ends(0)
        .says("shot.ltree: sound: 1 light, 2 emitters, 1 tree, ");
    let mut bytes = shot.read("shot.ltree");
    bytes[64] ^= 1;
    shot.write("table.ltree", &bytes);
    bytes[64] ^= 1;
    *bytes.last_mut().unwrap() ^= 1;
    shot.write("path.ltree", &bytes);
    shot.write("text.ltree", "a text");
    // The worst decides, and none keeps the others from being looked at.
    shot.candelabra("verify table.ltree path.ltree text.ltree shot.ltree")
        .ends(1)
        .says("table.ltree: unsound: rule HEAD 5: ")
        .says("path.ltree: unsound: rule TABL 10: section PATH is damaged")
        .says("text.ltree: unsound: rule HEAD 1: ")
        .says("shot.ltree: sound");
    shot.candelabra("verify absent.ltree path.ltree")
        .ends(2)
        .says("path.ltree: unsound")
        .complains(&["candelabra:", "absent.ltree", "No such file"]);
    shot.candelabra("verify").ends(2);
    shot.candelabra("verify --help")
        .ends(0)
        .says("1 a file is not")
        .says("2 a file cannot be read");
}

/// A broken promise under checksums that are right: the section, the record and the rule.
#[test]
fn it_names_the_first_broken_rule() {
    let shot = Shot::still();
    let golden =
        concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fuzz/corpus/tree/row_behind_the_rest.ltree");
    shot.write("golden.ltree", std::fs::read(golden).unwrap());
    shot.candelabra("verify golden.ltree")
        .ends(1)
        .says("golden.ltree: unsound: section LGHT, row 2 breaks rule LGHT 1: its emitters follow");
}
