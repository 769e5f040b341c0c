//! Files of the study: its page and a table for each axis.

use crate::Error;
use tongue_files::report::{Export, Markdown, Rows};

use super::AccuracyStudy;
use super::page::page;

pub type Files<'a> = Vec<(&'static str, Box<dyn Export + 'a>)>;

/// The page and a table for each axis; `made` says how and where it was made.
pub fn files<'a>(study: &'a AccuracyStudy, made: &str) -> Result<Files<'a>, Error> {
    Ok(vec![
        ("README.md", Box::new(Markdown(page(study, made)?))),
        ("1-equilibrium.csv", Box::new(Rows(&study.equilibrium))),
        ("2-trajectory.csv", Box::new(Rows(&study.trajectory))),
        ("3-early.csv", Box::new(Rows(&study.early))),
        ("4-mesh.csv", Box::new(Rows(&study.meshes))),
        ("5-fit.csv", Box::new(Rows(&study.fits))),
    ])
}
