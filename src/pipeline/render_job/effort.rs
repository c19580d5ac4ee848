//! How much work goes into a frame.

use crate::render::frame_names::FrameNames;
use crate::render::noise::Grey;
use serde::Serialize;
use std::str::FromStr;

/// How much work goes into a frame. Whatever is reached first ends it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effort {
    /// The error of the frame ([`noise`](crate::render::noise)); samples then go where the error is.
    pub error: Option<f64>,
    /// Seconds for each frame, from the start of the job: reading the scene is part of the first.
    pub seconds: Option<f64>,
    /// Samples of each pixel: as many if nothing else is asked for, else at most.
    pub samples: u32,
    /// Pictures whose numbers of samples are repeated, pixel by pixel.
    #[serde(skip)]
    pub plan: Option<FrameNames>,
    /// The grey floor; if not given, one for the shot is chosen from small pictures of it.
    pub grey: Option<Grey>,
}

impl Effort {
    /// Samples of each pixel at most, where an error or a time is asked for and no number is.
    pub const MOST: u32 = 16_384;

    /// The same number of samples in every pixel.
    pub fn samples(samples: u32) -> Effort {
        Effort { error: None, seconds: None, samples, plan: None, grey: None }
    }

    /// Whether the noise of the picture is looked at while it is rendered.
    pub fn looks(&self) -> bool {
        self.plan.is_none() && (self.error.is_some() || self.seconds.is_some())
    }

    /// Whether nothing but time tells how many samples there will be.
    pub(super) fn time_decides(&self) -> bool {
        self.looks() && self.error.is_none()
    }
}

/// Named errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// To see what is there.
    Draft,
    /// To judge light by.
    Preview,
    /// To hand on.
    Final,
}

impl Quality {
    /// The error that it stands for.
    pub fn error(self) -> f64 {
        match self {
            Quality::Draft => 0.1,
            Quality::Preview => 0.05,
            Quality::Final => 0.02,
        }
    }
}

impl FromStr for Quality {
    type Err = ();

    fn from_str(name: &str) -> Result<Quality, ()> {
        match name {
            "draft" => Ok(Quality::Draft),
            "preview" => Ok(Quality::Preview),
            "final" => Ok(Quality::Final),
            _ => Err(()),
        }
    }
}
