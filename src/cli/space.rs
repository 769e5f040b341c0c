//! `tongue-fit simulate --body space` or a folder: one equilibrium of a body in space, or one before and one after surgery.

use anyhow::{Result, anyhow, bail, ensure};

use tongue_fit::body::{Body, Unit};
use tongue_fit::inner::report;
use tongue_fit::inner::run::{Solved, SpaceSource};
use tongue_fit::inner::surgery::{FillingKind, Operation, Surgery};
use tongue_fit::system::{MusclesAs, SpaceModel};

use super::inputs::choice;
use super::{Global, Outcome, drive, output};

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Body in space")]
pub struct Arguments {
    /// Activation of a muscle, from 0 to 1: of both sides (GGP=0.1) or of one (GGP_L=0.1); may be given several times
    #[arg(long, value_name = "MUSCLE=A")]
    activation: Vec<String>,
    #[command(flatten)]
    model: ModelArguments,
    #[command(flatten)]
    surgery: SurgeryArguments,
}

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Surgery")]
struct SurgeryArguments {
    /// Operate elements whose middle lies in a box or ball (mm), or of a muscle: box:X0,X1,Y0,Y1,Z0,Z1, ball:X,Y,Z,R or GGP_L; with left:
    /// or right: in front, of one side only; may be given several times
    #[arg(long, value_name = "REGION", requires = "filling", hide_short_help = true)]
    operate: Vec<String>,
    /// What is left there, which decides to which side the tongue deviates: nothing (removed: what remains moves freely), a scar (stiff,
    /// without muscle), a flap (as stiff as tongue, without muscle), or tissue whose nerve is cut (silent)
    #[arg(long, value_name = "KIND", value_parser = choice::<FillingKind>(), requires = "operate", hide_short_help = true)]
    filling: Option<FillingKind>,
    /// How many times as stiff as tongue a scar is
    #[arg(long, value_name = "N", default_value_t = 10.0, requires = "filling", hide_short_help = true)]
    scar: f64,
    /// Find activations, with the sides apart, that bring the tip back to where it was before surgery
    #[arg(long, requires = "operate", hide_short_help = true)]
    make_up: bool,
}

impl SurgeryArguments {
    fn surgery(&self) -> Option<Surgery> {
        Some(Surgery {
            operate: self.operate.clone(),
            filling: self.filling.filter(|_| !self.operate.is_empty())?,
            scar: self.scar,
            make_up: self.make_up,
        })
    }
}

#[derive(Debug, Clone, Default, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Body in space")]
pub struct ModelArguments {
    /// Muscles: stress along fibres, whose answers hold on finer meshes, or lines from node to node, as in ArtiSynth
    #[arg(long, value_name = "KIND", value_parser = choice::<MusclesAs>(), default_value = "stress", hide_short_help = true)]
    muscles_as: MusclesAs,
    /// Stiffening of a muscle's tissue by full activation, as a multiple of its passive stiffness (ArtiSynth: 9)
    #[arg(long, value_name = "GAIN", default_value_t = 0.0, hide_short_help = true)]
    stiffening: f64,
    /// Cut every hexahedron in eight
    #[arg(long, hide_short_help = true)]
    refined: bool,
    /// The node, by its number from 1, that is the tip, from which places of coils are counted [default: the foremost of the midsagittal
    /// plane]
    #[arg(long, value_name = "NODE", hide_short_help = true)]
    tip: Option<usize>,
    /// Unit of the coordinates of a body from Gmsh (--body FILE.msh)
    #[arg(long, value_name = "UNIT", value_parser = choice::<Unit>(), default_value = "m", hide_short_help = true)]
    body_unit: Unit,
}

impl ModelArguments {
    pub fn body(&self, source: &SpaceSource) -> Result<Body<3>> {
        if self.body_unit != Unit::M && !matches!(source, SpaceSource::Mesh(_)) {
            bail!("--body-unit is the unit of a body from Gmsh: --body FILE.msh");
        }
        if *source == SpaceSource::BuiltIn && self.muscles_as == MusclesAs::Lines {
            bail!("--muscles-as lines needs fibres from node to node, which the built-in body does not have");
        }
        let mut body = source.make(self.body_unit, self.refined)?;
        if let Some(tip) = self.tip {
            let outline = body.midsagittal_mesh().outlines();
            body.tip_node = tip.checked_sub(1).filter(|node| outline.iter().flatten().any(|n| n == node));
            ensure!(
                body.tip_node.is_some(),
                "--tip {tip}: {} has no such node on its midsagittal contour; nodes are counted from 1",
                body.what
            );
        }
        Ok(body)
    }

    pub fn model(&self) -> Result<SpaceModel> {
        let model =
            SpaceModel { muscles: self.muscles_as, stiffening: self.stiffening, ..SpaceModel::default() };
        model.check()?;
        Ok(model)
    }
}

/// Activations of all muscles of a body from texts such as `GGP=0.1`.
pub fn activations(words: &[String], body: &Body<3>) -> Result<Vec<f64>> {
    let given = drive::pairs("--activation", words, "GGP=0.1")?;
    body.activations(&given).map_err(|error| anyhow!("--activation: {error}"))
}

pub fn run(source: &SpaceSource, arguments: &Arguments, direct: bool, global: &Global) -> Result<Outcome> {
    let whole = arguments.model.body(source)?;
    let all = activations(&arguments.activation, &whole)?;
    let model = arguments.model.model()?;
    let surgery = arguments.surgery.surgery();
    let operation = surgery.map(|surgery| Operation::new(&surgery, whole.clone())).transpose()?;
    let out = global.given_folder()?;
    let solved = Solved::in_space(&whole, &model, &all, direct, &output::tell_step)?;
    let (body, solved, changed, shapes) = match &operation {
        None => (&whole, solved, None, "at rest (light) and deformed"),
        Some(operation) => {
            let (after, changed) = operation.solve_after(&solved, &model, direct, &output::tell_step)?;
            if arguments.surgery.make_up && changed.made_up_by.is_none() {
                output::note(
                    "the tip itself is removed, so no activations are searched that would bring it back",
                );
            }
            (operation.body(), after, Some(changed), "before surgery (light) and after it")
        }
    };
    let active = whole.active(&all).into_iter().map(|(name, a)| format!(", {name} {a}"));
    let title = format!("Tongue in space{}: {shapes}", active.collect::<String>());
    let picture = report::views(body, &solved.positions, &solved.pulls, &title, changed.as_ref());
    output::answer_equilibrium(body, &solved, changed, picture, (out.as_ref(), global))
}
