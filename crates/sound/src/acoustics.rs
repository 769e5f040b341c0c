//! Acoustic constants of the air, the walls and the lips.

/// Constants of moist air at body temperature in SI units (Flanagan 1972, table 3.1 and section 3.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    pub speed: f64,
    pub density: f64,
    pub viscosity: f64,
    pub conduction: f64,
    /// Specific heat at constant pressure, J/(kg K).
    pub specific_heat: f64,
    /// Ratio of specific heats.
    pub adiabatic: f64,
}

impl Default for Air {
    fn default() -> Self {
        Self {
            speed: 350.0,
            density: 1.14,
            viscosity: 1.86e-5,
            conduction: 0.0230,
            specific_heat: 1005.0,
            adiabatic: 1.4,
        }
    }
}

/// Mechanical impedance of the soft wall per area: mass, kg/m^2, resistance, kg/(m^2 s), and stiffness, N/m^3, in series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallImpedance {
    pub mass: f64,
    pub resistance: f64,
    pub stiffness: f64,
}

impl Default for WallImpedance {
    /// Values of Maeda (1982): 1.5 g/cm^2, 1600 g/(s cm^2), 3.0e5 dyn/cm^3.
    fn default() -> Self {
        Self { mass: 15.0, resistance: 16_000.0, stiffness: 3.0e6 }
    }
}

/// Effects that the acoustic model includes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Acoustics {
    pub air: Air,
    /// Whether air loses energy to the wall by viscosity and heat.
    pub friction: bool,
    /// The wall, if it yields.
    pub wall: Option<WallImpedance>,
    /// Whether the lips radiate as a piston in a plane baffle (Flanagan 1972, 3.33); otherwise the pressure at the lips is zero.
    pub radiation: bool,
    /// Circumference of a cross-section over that of a circle of the same area: cross-sections of a tract are not circles.
    pub shape_factor: f64,
}

impl Default for Acoustics {
    fn default() -> Self {
        Self {
            air: Air::default(),
            friction: true,
            wall: Some(WallImpedance::default()),
            radiation: true,
            shape_factor: 1.3,
        }
    }
}

impl Acoustics {
    /// A rigid tube without losses whose pressure is zero at the lips.
    pub fn ideal() -> Self {
        Self { friction: false, wall: None, radiation: false, ..Self::default() }
    }
}
