//! `tongue-fit simulate`: one equilibrium at given tensions, or the motion there.

use anyhow::Result;
use tongue_fit::inner::report::{self, SectionPicture};
use tongue_fit::inner::run::Solved;

use super::{Global, Outcome, body, drive, output, space, trajectory};

#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Example (the published answer for /a/):\n  \
        tongue-fit simulate --tension GGa=12 --tension SGm=11.5 --tension HGa=4.5\n\n\
        Example (its first 3 s):\n  \
        tongue-fit simulate --tension GGa=12 --tension SGm=11.5 --tension HGa=4.5 --trajectory\n\n\
        Example (activity measured by EMG, 30 N/m at activity 1):\n  \
        tongue-fit simulate --emg emg.csv --vowel a --full 30\n\n\
        Example (in space; ArtiSynth's tongue with --body path/to/tongue3d):\n  \
        tongue-fit simulate --body space --activation GGP=0.1 --activation TRANS=0.1")]
pub struct Arguments {
    #[command(flatten)]
    pulls: drive::Arguments,
    /// Solve at the full tensions only, for very fine meshes. By default the equilibria from rest are followed as the tensions grow, to
    /// check that the answer lies on their branch
    #[arg(long, conflicts_with = "trajectory", hide_short_help = true)]
    direct: bool,
    /// Colour the tissue of the picture by its largest principal stretch
    #[arg(long, conflicts_with = "trajectory")]
    colour_stretch: bool,
    #[command(flatten)]
    trajectory: trajectory::Arguments,
    #[command(flatten)]
    body: body::Arguments,
    #[command(flatten)]
    space: space::Arguments,
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    if let Some(source) = arguments.body.space() {
        return space::run(source, &arguments.space, arguments.direct, global);
    }
    if arguments.trajectory.trajectory {
        return trajectory::run(&arguments.trajectory, &arguments.pulls, &arguments.body, global);
    }
    let body = arguments.body.body()?;
    let given = arguments.pulls.tensions(&body)?;
    body::tell_duration_of_equilibrium(body.mesh.nodes.len());
    let palate = body.palate.as_deref().unwrap_or_default();
    let out = global.given_folder()?;
    let solved = Solved::in_plane(&body, &arguments.body.model(), &given, arguments.direct)?;
    let solution = &solved.equilibrium.solution;
    output::step(|| format!("{:?} in {} iterations", solution.status, solution.iterations));
    let title = "Tongue at rest (grey) and deformed";
    let section = SectionPicture::new(&body.mesh, &solved.positions, &solved.pulls, palate, title);
    let picture = report::tongue(&SectionPicture { stretch: arguments.colour_stretch, ..section });
    output::answer_equilibrium(&body, &solved, None, picture, (out.as_ref(), global))
}
