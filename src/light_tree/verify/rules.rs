//! The rules that a tree file keeps, beyond those of its container. The [format](crate::store) has them
//! by the same numbers, in the same words.

use crate::light_tree::records;
use crate::store::{RULES_OF_HEADER, RULES_OF_TABLE, Rule, rules};

/// All rules that a tree file keeps, part by part.
pub const RULES: [&[Rule]; 12] = [
    RULES_OF_HEADER,
    RULES_OF_TABLE,
    OF_TREES,
    OF_GROUPS,
    OF_INSTANCES,
    OF_FRAMES,
    OF_FINGERPRINTS,
    OF_FORCED,
    OF_LIGHTS,
    OF_TEXTURES,
    OF_MEANS,
    OF_LINKS,
];

rules! {
    records::TREES, OF_TREES:
    TREE_IS_OF_A_KIND = "its kind is 0, 1 or 2, and it has a group and a leaf at least";
    TREES_ARE_IN_ORDER = "trees are in order of kind, at most one of kind 1";
    TREES_USE_THE_GROUPS = "its groups follow those of the tree before it; together they are all of GRUP";
    ROOT_IS_SOUND = "its root keeps rules GRUP 4, 5 and 6, and its link is 0";
    LEAVES_ARE_COUNTED = "it has as many leaves as it says";
    TREE_HOLDS_ITS_LIGHTS = "it holds just the emitters and trees of its kind, each once";
}

rules! {
    records::GROUPS, OF_GROUPS:
    GROUPS_ARE_NUMBERED = "there are fewer than 2^27";
    UNUSED_LANE_IS_ZERO = "a lane whose link is 0 is all zero";
    GROUPS_ARE_IN_PREORDER = "every group but a tree's first has one lane that leads to it, in preorder";
    BOX_IS_FINITE = "its box is finite";
    ENERGY_IS_POSITIVE = "its energy is finite and more than 0";
    AXIS_IS_IN_RANGE = "no part of its axis is -32768";
    BOX_IS_IN_PARENT = "its box lies inside its parent's";
    EMISSION_IS_IN_PARENT = "its theta_e is not beyond its parent's, unless the parent's theta_o is pi, nor is it two-sided alone";
    RANGE_IS_IN_PARENT = "its range is not beyond its parent's";
    CONE_IS_IN_PARENT = "its cone lies inside its parent's";
    ENERGIES_ADD_UP = "the energies of its lanes add up to its parent's, to 1e-6";
    EMITTER_HAS_ONE_LEAF = "an emitter belongs to its tree and has one leaf there";
    INSTANCE_IS_EARLIER = "an instance is there and of an earlier tree";
    PLACED_BOX_IS_INSIDE = "the box of a placed tree lies inside the leaf's, to 2e-5 of its size and place";
    PLACED_CONE_IS_INSIDE = "the cone of a placed tree lies inside the leaf's, to 2e-3 rad";
}

rules! {
    records::INSTANCES, OF_INSTANCES:
    INSTANCE_IS_OF_A_TREE = "its tree is there, and of kind 0 or 1";
    INSTANCE_KEEPS_SHAPES = "its transform is finite, and its axes are of one length and at right angles, to 1e-4";
    INSTANCE_SPARE_IS_ZERO = "its spare bytes are 0";
    STILL_IS_IN_PLACE = "if its tree is of kind 1, its transform is the identity and its first emitter 0";
}

rules! {
    records::FRAMES, OF_FRAMES:
    FRAMES_ASCEND = "frames ascend";
    FRAME_HAS_ITS_TREE = "its tree is of kind 2 if a light of class 2 or 3 is there, else of kind 1 or none";
    FRAMES_USE_FORCED = "its entries of FORC follow those of the frame before it; together they are all";
}

rules! {
    records::FINGERPRINTS, OF_FINGERPRINTS:
    FRAMES_HAVE_FINGERPRINTS = "each row of FRAM has one";
}

rules! {
    records::FORCED, OF_FORCED:
    FORCED_IS_A_TREE = "its instance is there and of a tree of kind 0";
    FORCED_ARE_ALL = "the entries of a frame are the forced lights, each once, in order";
}

rules! {
    records::LIGHTS, OF_LIGHTS:
    EMITTERS_FOLLOW = "its emitters follow those of the light before it, from 0 on";
    CLASS_IS_KNOWN = "its class is 0, 1, 2, 3, 5 or 7";
    LOOK_IS_KNOWN = "its kind is 0 to 4, and the largest part of its colour 65535, or 0";
    LIGHT_ENERGY_IS_A_NUMBER = "its energy is finite and not negative";
    PATH_IS_TEXT = "its path is UTF-8 inside PATH, and not empty";
    LIGHTS_ARE_IN_ORDER = "lights are in order of class and then of path, no two alike";
    EMITTERS_ARE_NUMBERED = "there are fewer than 2^30 emitters; those of class 0 are no more than the lanes of all groups";
}

rules! {
    records::TEXTURES, OF_TEXTURES:
    FINGERPRINTS_ASCEND = "fingerprints ascend";
    TEXTURES_USE_THE_MEANS = "its means follow those of the row before it; together they are all of MEAN";
}

rules! {
    records::MEANS, OF_MEANS:
    MEAN_IS_LIGHT = "the mean is finite, not negative and not black";
    TRIANGLES_ASCEND = "the triangles of one row of TXTR ascend";
}

rules! {
    records::LINKS, OF_LINKS:
    LIGHTS_HAVE_LINKS = "each row of LGHT has one";
    LINKS_ARE_NUMBERED = "it is 0, or that of a light before it, or the next one after those";
    SOME_LIGHT_IS_LINKED = "one of them is not 0";
}
