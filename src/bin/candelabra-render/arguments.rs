//! The command line.

use crate::display::Progress;
use candelabra::pipeline::{Effort, Preview, RenderJob, StageOptions, Strict, View, option};
use candelabra::render::frame_names::FrameNames;
use candelabra::render::frames::Frames;
use candelabra::render::noise::Grey;
use candelabra::render::{
    Aov, LightGroupRule, LightStrategy, RenderSettings, Split, SplitBy, Window,
};
use candelabra::scene::Medium;
use clap::{Parser, ValueEnum};
use std::path::PathBuf;

/// Renders the frames of a shot through a light tree.
///
/// Exit codes: 0 done, 1 a frame or everything failed, 2 usage, 3 the tree is stale or
/// broken, or was written to while it was in use; 128 and a signal's number if that signal stopped it (130
/// Ctrl-C, 143 SIGTERM): finished frames are kept.
#[derive(Parser)]
#[command(version, arg_required_else_help = true)]
pub struct Arguments {
    /// The scene: .gltf, .glb or .obj, or a USD stage
    pub scene: PathBuf,
    /// Its light tree, from `candelabra build`; built in memory if not given
    #[arg(long)]
    pub tree: Option<PathBuf>,
    /// What of its lights is hidden from where, from `candelabra learn`
    #[arg(long, value_name = "FILE")]
    pub learned: Option<PathBuf>,
    /// Frames: 1001-1048, 1001-1048x2, 1,5,9; the first of the scene if not given
    #[arg(short, long, allow_hyphen_values = true)]
    pub frames: Option<Frames>,
    /// The pictures: street.####.exr or street.%04d.exr. In the file's name %# is a number sign and %% a
    /// percent sign; folders are taken as they are written
    #[arg(short, long, value_parser = pictures)]
    pub output: FrameNames,
    /// The error that a frame may have: draft (0.1), preview (0.05), final (0.02), or a number. Noise as a
    /// share of the light, or of the grey floor where it is darker; samples then go where it is
    #[arg(long, value_parser = option::error)]
    pub error: Option<f64>,
    /// How long a frame may take: 90, 90s, 10m or 1.5h, from the start of the program
    #[arg(long, value_parser = option::duration)]
    pub time: Option<f64>,
    /// Samples of each pixel; with --error or --time the most that any pixel gets. 64 if nothing is asked for
    #[arg(long, visible_alias = "max-spp", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,
    /// Repeat the numbers of samples of earlier pictures, pixel by pixel, such as out/street.####.exr
    #[arg(long, value_name = "PICTURES", value_parser = pictures, conflicts_with_all = ["error", "time", "spp"])]
    pub plan: Option<FrameNames>,
    /// The grey floor: the luminance in the picture below which error is absolute; if not given, a tenth of
    /// the shot's middle
    #[arg(long, value_name = "LUMINANCE", value_parser = option::grey)]
    pub grey: Option<Grey>,
    /// Render so many pixels of each frame again, with 16 times the samples, and say how far off its error is
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(2..))]
    pub audit: Option<u32>,
    /// Keep a frame in the making beside its picture after each pass, and go on with one that is there
    #[arg(long)]
    pub checkpoint: bool,
    /// Bounces of light to the eye: 0 shows emitters only, 1 adds direct light
    #[arg(long, default_value_t = 5)]
    pub depth: u32,
    /// Size of the picture in pixels, WxH; 720 high in the camera's shape if not given
    #[arg(long, value_parser = option::size)]
    pub res: Option<(u32, u32)>,
    #[command(flatten)]
    pub view: View,
    /// Another seed, another noise
    #[arg(long, default_value_t = 0)]
    pub seed: u32,
    /// Render each frame as an instant, even if the camera has a shutter
    #[arg(long)]
    pub no_motion_blur: bool,
    /// Threads; as many as there are cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// How lights are picked
    #[arg(long, value_enum, default_value_t = Strategy::Tree)]
    pub light_sampler: Strategy,
    /// How readily clusters of lights are split: 0 samples one light at a point, 1 every one [default:
    /// measured in a small picture of the shot]
    #[arg(long, value_parser = option::knob)]
    pub split: Option<f32>,
    /// At most so many lights are sampled at a point, beside the forced ones
    #[arg(long, default_value_t = RenderSettings::default().max_lights, value_parser = clap::value_parser!(u32).range(1..))]
    pub max_lights: u32,
    /// What makes a cluster worth splitting
    #[arg(long, value_enum, default_value_t = Test::Variance)]
    pub split_by: Test,
    /// Leave the lights at or below a prim path out of all estimates and sample them at every point;
    /// may be given again. The tree must have been built with the same
    #[arg(long, value_name = "PATH")]
    pub force_light: Vec<String>,
    /// Fill the scene with fog, in place of its own: extinction per metre, albedo (1 if not given)
    /// and anisotropy (0), as 0.02,0.9,0.3
    #[arg(long, value_name = "EXTINCTION,ALBEDO,G", value_parser = option::fog)]
    pub fog: Option<Medium>,
    /// Write a PNG beside each picture
    #[arg(long)]
    pub png: bool,
    /// Exposure of the PNG in stops; if not given, one for the shot, chosen from the scene's first frame
    #[arg(long, allow_negative_numbers = true, requires = "png", value_parser = option::stops)]
    pub exposure: Option<f32>,
    /// Beauty in 32-bit floats instead of 16
    #[arg(long)]
    pub float: bool,
    /// Layers to write beside the beauty; may be given again, or as a list with commas
    #[arg(long, value_enum, value_name = "LAYER", value_delimiter = ',', default_values_t = Aov::DEFAULT)]
    pub aov: Vec<Aov>,
    /// Put the lights at prim paths that match, and below them, into a light group, as
    /// key=/World/Lamps/key*; may be given again, the first that matches counts. Light groups are then
    /// written, whether or not --aov names them
    #[arg(long, value_name = "NAME=PATTERN")]
    pub light_group: Vec<LightGroupRule>,
    /// Render only the pixels from column X0 to column X1 and from row Y0 to row Y1, without X1 and Y1;
    /// (0, 0) is the top left. The rest of the picture is not in the file
    #[arg(long, num_args = 4, value_names = ["X0", "Y0", "X1", "Y1"])]
    pub crop: Option<Vec<u32>>,
    /// Skip frames that are there, whole, and rendered from the same scene and settings
    #[arg(long)]
    pub resume: bool,
    /// Do not prove that the tree file is sound before using it
    #[arg(long)]
    pub no_verify: bool,
    /// Take notes about the scene for errors: all, or those of the categories given, such as
    /// --strict=lights,cameras (lights, materials, geometry, cameras, animation, other)
    #[arg(long, value_name = "CATEGORIES", num_args = 0..=1, require_equals = true, default_missing_value = Strict::EVERYTHING)]
    pub strict: Option<Strict>,
    #[command(flatten)]
    pub stage: StageOptions,
    #[command(flatten)]
    pub progress: Progress,
    /// Print at the end where time and memory went, as text or JSON
    #[arg(long, value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "text")]
    pub stats: Option<StatsForm>,
}

/// How statistics are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StatsForm {
    /// Over several lines
    Text,
    /// A JSON object on one line
    Json,
}

/// How lights are picked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Strategy {
    /// Every light alike
    Uniform,
    /// By energy, the same everywhere
    Power,
    /// Through the light tree, by energy and distance but without orientation
    Distance,
    /// By importance, through the light tree
    Tree,
    /// By the importance of every emitter: what a perfect traversal would do; slow
    Exhaustive,
    /// All of them, at every point: the traditional loop; slow
    All,
}

/// What makes a cluster worth splitting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Test {
    /// Its part in the variance of one sample
    Variance,
    /// As Conty and Kulla showed it: its solid angle times the peak of the BSDF; all clusters left are sampled
    SolidAngle,
}

/// Pictures are OpenEXR files, and their previews are named after them.
fn pictures(pattern: &str) -> Result<FrameNames, String> {
    if !pattern.to_ascii_lowercase().ends_with(".exr") {
        return Err(format!("pictures are OpenEXR files: end the name in .exr, as {pattern}.exr"));
    }
    FrameNames::new(pattern).map_err(|error| error.to_string())
}

impl Arguments {
    /// The job that they ask for.
    pub fn job(&self) -> RenderJob {
        RenderJob {
            scene: self.scene.clone(),
            stage: self.stage.clone(),
            tree: self.tree.clone(),
            learned: self.learned.clone(),
            frames: self.frames.clone(),
            output: self.output.clone(),
            view: self.view.clone(),
            size: self.res,
            settings: self.settings(),
            effort: self.effort(),
            audit: self.audit,
            checkpoint: self.checkpoint,
            fog: self.fog.clone(),
            force_lights: self.force_light.clone(),
            preview: self.png.then_some(Preview { exposure: self.exposure }),
            resume: self.resume,
            verify: !self.no_verify,
            strict: self.strict.clone(),
        }
    }

    /// The layers, in one order and each once: the same picture has the same settings.
    fn aovs(&self) -> Vec<Aov> {
        let of_groups = Some(Aov::LightGroups).filter(|_| !self.light_group.is_empty());
        let mut aovs: Vec<Aov> =
            self.aov.iter().copied().chain(of_groups).chain([Aov::Beauty]).collect();
        aovs.sort_unstable();
        aovs.dedup();
        aovs
    }

    fn effort(&self) -> Effort {
        let looks = self.error.is_some() || self.time.is_some();
        let samples = if looks { Effort::MOST } else { RenderSettings::default().samples };
        Effort {
            error: self.error,
            seconds: self.time,
            samples: self.spp.unwrap_or(samples),
            plan: self.plan.clone(),
            grey: self.grey,
        }
    }

    fn settings(&self) -> RenderSettings {
        RenderSettings {
            depth: self.depth,
            seed: self.seed,
            strategy: match self.light_sampler {
                Strategy::Uniform => LightStrategy::Uniform,
                Strategy::Power => LightStrategy::Power,
                Strategy::Distance => LightStrategy::Distance,
                Strategy::Tree => LightStrategy::Tree,
                Strategy::Exhaustive => LightStrategy::Exhaustive,
                Strategy::All => LightStrategy::All,
            },
            motion_blur: !self.no_motion_blur,
            split: self.split.map_or(Split::Auto, Split::Fixed),
            max_lights: self.max_lights,
            split_by: match self.split_by {
                Test::Variance => SplitBy::Variance,
                Test::SolidAngle => SplitBy::SolidAngle,
            },
            aovs: self.aovs(),
            float_beauty: self.float,
            light_groups: self.light_group.clone(),
            crop: self.crop.as_deref().and_then(|edges| match *edges {
                [x0, y0, x1, y1] => Some(Window { x0, y0, x1, y1 }),
                _ => None,
            }),
            ..RenderSettings::default()
        }
    }
}
