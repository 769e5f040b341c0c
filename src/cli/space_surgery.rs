//! `tongue-fit simulate --body space --operate REGION --filling KIND`: options of surgery.

use tongue_fit::surgery::{FillingKind, Surgery};

use super::choice::choice;

/// Options of surgery.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Surgery")]
pub struct Arguments {
    /// Operate elements whose middle lies in a box or ball (mm), or of a muscle: box:X0,X1,Y0,Y1,Z0,Z1,
    /// ball:X,Y,Z,R or GGP_L; with left: or right: in front, of one side only; may be given several times
    #[arg(
        long,
        value_name = "REGION",
        allow_hyphen_values = true,
        requires = "filling",
        hide_short_help = true
    )]
    operate: Vec<String>,
    /// What is left there, which decides to which side the tongue deviates: nothing (removed: what
    /// remains moves freely), a scar (stiff, without muscle), a flap (as stiff as tongue, without
    /// muscle), or tissue whose nerve is cut (silent)
    #[arg(long, value_name = "KIND", value_parser = choice::<FillingKind>(), requires = "operate", hide_short_help = true)]
    filling: Option<FillingKind>,
    /// How many times as stiff as tongue a scar is
    #[arg(
        long,
        value_name = "N",
        default_value_t = 10.0,
        allow_negative_numbers = true,
        requires = "filling",
        hide_short_help = true
    )]
    scar: f64,
    /// Find activations, with the sides apart, that bring the tip back to where it was before surgery
    #[arg(long, requires = "operate", hide_short_help = true)]
    make_up: bool,
}

impl Arguments {
    /// What is asked for, if anything is.
    pub fn surgery(&self) -> Option<Surgery> {
        Some(Surgery {
            operate: self.operate.clone(),
            filling: self.filling.filter(|_| !self.operate.is_empty())?,
            scar: self.scar,
            make_up: self.make_up,
        })
    }
}
