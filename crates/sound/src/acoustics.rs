//! Constants of the air and the walls in SI units, and the effects that the acoustic model includes.

// Moist air at body temperature (Flanagan 1972, table 3.1 and section 3.2).
/// Speed of sound, m/s.
pub(crate) const SPEED: f64 = 350.0;
/// Density, kg/m^3.
pub(crate) const DENSITY: f64 = 1.14;
/// Viscosity, Pa s.
pub(crate) const VISCOSITY: f64 = 1.86e-5;
/// Conductivity of heat, W/(m K).
pub(crate) const CONDUCTION: f64 = 0.0230;
/// Specific heat at constant pressure, J/(kg K).
pub(crate) const SPECIFIC_HEAT: f64 = 1005.0;
/// Ratio of specific heats.
pub(crate) const ADIABATIC: f64 = 1.4;

// Mass, kg/m^2, resistance, kg/(m^2 s), and stiffness, N/m^3, of the soft wall per area, in series (Maeda 1982: 1.5 g/cm^2,
// 1600 g/(s cm^2), 3.0e5 dyn/cm^3).
pub(crate) const WALL_MASS: f64 = 15.0;
pub(crate) const WALL_RESISTANCE: f64 = 16_000.0;
pub(crate) const WALL_STIFFNESS: f64 = 3.0e6;

/// Effects that the acoustic model includes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Acoustics {
    /// Whether air loses energy to the wall by viscosity and heat.
    pub friction: bool,
    /// Whether the wall yields.
    pub wall: bool,
    /// Whether the lips radiate as a piston in a plane baffle (Flanagan 1972, 3.33); otherwise the pressure at the lips is zero.
    pub radiation: bool,
    /// Circumference of a cross-section over that of a circle of the same area: cross-sections of a tract are not circles.
    pub shape_factor: f64,
}

impl Default for Acoustics {
    fn default() -> Self {
        Self { friction: true, wall: true, radiation: true, shape_factor: 1.3 }
    }
}
