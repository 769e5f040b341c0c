//! `tongue-fit simulate --body space --operate REGION --filling KIND`: before and after surgery.

use std::collections::BTreeSet;

use clap::ValueEnum;
use miette::{IntoDiagnostic, miette};
use nalgebra::Vector3;

use tongue_fit::body::SpaceBody;
use tongue_fit::body::space::{Filling, Operated, Region, Side};
use tongue_fit::inverse::in_space::SpaceSearch;
use tongue_fit::measured::{ByMuscle, SpaceMark};
use tongue_fit::report::OperationRecord;
use tongue_fit::system::System;

/// Options of surgery.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Surgery")]
pub struct Arguments {
    /// Operate elements whose middle lies in a box or ball (mm), or of a muscle: box:X0,X1,Y0,Y1,Z0,Z1,
    /// ball:X,Y,Z,R or GGP_L; with left: or right: in front, of one side only; may be given several times
    #[arg(long, value_name = "REGION", allow_hyphen_values = true, requires = "filling")]
    operate: Vec<String>,
    /// What is left there, which decides to which side the tongue deviates: nothing (removed: what
    /// remains moves freely), a scar (stiff, without muscle), a flap (as stiff as tongue, without
    /// muscle), or tissue whose nerve is cut (silent)
    #[arg(long, value_name = "KIND", value_enum, requires = "operate")]
    filling: Option<FillingName>,
    /// How many times as stiff as tongue a scar is
    #[arg(
        long,
        value_name = "N",
        default_value_t = 10.0,
        allow_negative_numbers = true,
        requires = "filling"
    )]
    scar: f64,
    /// Find activations, with the sides apart, that bring the tip back to where it was before surgery
    #[arg(long, requires = "operate")]
    make_up: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FillingName {
    Removed,
    Scar,
    Flap,
    Silent,
}

/// Nodes nearer to the foremost one than this belong to the tip, m.
const TIP_M: f64 = 8e-3;

impl Arguments {
    /// Whether there is surgery.
    pub fn is_given(&self) -> bool {
        !self.operate.is_empty()
    }

    /// The body after surgery.
    pub fn operate(&self, body: &SpaceBody) -> miette::Result<Operated> {
        let filling = match self.filling {
            Some(FillingName::Scar) if !(self.scar.is_finite() && self.scar > 0.0 && self.scar <= 1e6) => {
                return Err(miette!("--scar is {}; it must lie above 0 and be at most 1e6", self.scar));
            }
            Some(FillingName::Scar) => Filling::Scar(self.scar),
            Some(FillingName::Flap) => Filling::Flap,
            Some(FillingName::Silent) => Filling::Silent,
            _ => Filling::Removed,
        };
        let mut elements = BTreeSet::new();
        for word in &self.operate {
            let wrong = |fault: &dyn std::fmt::Display| miette!("--operate {word}: {fault}");
            let (region, side) = region(word).map_err(|fault| wrong(&fault))?;
            elements.extend(body.elements_in(&region, side).map_err(|fault| wrong(&fault))?);
        }
        body.operated(&elements, filling).map_err(|fault| miette!("--operate: {fault}"))
    }

    /// What surgery changed: positions of all nodes before and after.
    pub fn compare(
        &self,
        body: &SpaceBody,
        (operated, system): (&Operated, &System<3>),
        [before, after]: [&[Vector3<f64>]; 2],
    ) -> miette::Result<OperationRecord> {
        let mut record = OperationRecord::new(body, operated, [before, after]);
        record.regions.clone_from(&self.operate);
        record.filling = self.filling.and_then(|f| Some(f.to_possible_value()?.get_name().to_owned()));
        if self.make_up {
            let free = |n: &usize| operated.body.mesh.fixed.binary_search(n).is_err();
            let rest = &body.mesh.nodes;
            let Some(tip) = body.foremost() else { return Ok(record) };
            let near = (0..rest.len()).filter(free).filter(|&n| (rest[n] - rest[tip]).norm() < TIP_M);
            let seen: Vec<SpaceMark> = near.map(|node| SpaceMark::node(node, before[node], 5e-4)).collect();
            let search = SpaceSearch { sides_apart: true, ..SpaceSearch::default() };
            let fit = search.fit(&operated.body, system, &seen, None).into_diagnostic()?;
            record.made_up_by = Some(ByMuscle::new(&fit.names, fit.found()));
            record.made_up_to_mm = Some(1e3 * fit.rms_m);
        }
        Ok(record)
    }
}

/// Reads a region and its side.
fn region(word: &str) -> Result<(Region, Option<Side>), String> {
    let (side, word) = match (word.strip_prefix("left:"), word.strip_prefix("right:")) {
        (Some(rest), _) => (Some(Side::Left), rest),
        (_, Some(rest)) => (Some(Side::Right), rest),
        _ => (None, word),
    };
    let numbers = |text: &str| -> Result<Vec<f64>, String> {
        let number = |t: &str| {
            t.trim().parse::<f64>().map(|mm| 1e-3 * mm).map_err(|_| format!("\"{t}\" is not a number"))
        };
        text.split(',').map(number).collect()
    };
    let region = if let Some(text) = word.strip_prefix("box:") {
        match numbers(text)?[..] {
            [x0, x1, y0, y1, z0, z1] => Region::Box([Vector3::new(x0, y0, z0), Vector3::new(x1, y1, z1)]),
            _ => return Err("a box has six numbers: box:X0,X1,Y0,Y1,Z0,Z1 in mm".to_owned()),
        }
    } else if let Some(text) = word.strip_prefix("ball:") {
        match numbers(text)?[..] {
            [x, y, z, r] => Region::Ball(Vector3::new(x, y, z), r),
            _ => return Err("a ball has four numbers: ball:X,Y,Z,R in mm".to_owned()),
        }
    } else {
        Region::Muscle(word.to_owned())
    };
    Ok((region, side))
}
