//! Shapes of cells, and curves.

mod hexahedron;
mod natural_spline;
mod quadratic;
mod simplex;
mod spline;
mod thin_plate;
mod topology;
