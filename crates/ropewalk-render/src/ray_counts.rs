//! Numbers of rays by kind.

/// Why a ray was shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RayKind {
    /// From the eye.
    Primary,
    /// Mirrored at a reflective or transmitting surface.
    Reflection,
    /// Refracted at a transmitting surface.
    Refraction,
    /// From a surface towards a light.
    Shadow,
}

impl RayKind {
    /// All kinds, in the order of their use as an index.
    pub const ALL: [RayKind; 4] =
        [RayKind::Primary, RayKind::Reflection, RayKind::Refraction, RayKind::Shadow];

    /// Place in [`RayKind::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            RayKind::Primary => "primary",
            RayKind::Reflection => "reflection",
            RayKind::Refraction => "refraction",
            RayKind::Shadow => "shadow",
        }
    }
}

/// How many rays of each kind were shot, and how many of them hit something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Eye rays.
    pub primary: u64,
    /// Eye rays that hit.
    pub primary_hits: u64,
    /// Reflection rays.
    pub reflection: u64,
    /// Reflection rays that hit.
    pub reflection_hits: u64,
    /// Refraction rays.
    pub refraction: u64,
    /// Refraction rays that hit.
    pub refraction_hits: u64,
    /// Shadow rays.
    pub shadow: u64,
    /// Shadow rays that are blocked.
    pub shadow_hits: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.primary + self.secondary() + self.shadow
    }

    /// Reflection and refraction rays.
    pub fn secondary(&self) -> u64 {
        self.reflection + self.refraction
    }

    /// Reflection and refraction rays that hit.
    pub fn secondary_hits(&self) -> u64 {
        self.reflection_hits + self.refraction_hits
    }

    pub(crate) fn record(&mut self, kind: RayKind, hit: bool) {
        let (rays, hits) = match kind {
            RayKind::Primary => (&mut self.primary, &mut self.primary_hits),
            RayKind::Reflection => (&mut self.reflection, &mut self.reflection_hits),
            RayKind::Refraction => (&mut self.refraction, &mut self.refraction_hits),
            RayKind::Shadow => (&mut self.shadow, &mut self.shadow_hits),
        };
        *rays += 1;
        *hits += u64::from(hit);
    }
}

impl std::ops::AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.primary += o.primary;
        self.primary_hits += o.primary_hits;
        self.reflection += o.reflection;
        self.reflection_hits += o.reflection_hits;
        self.refraction += o.refraction;
        self.refraction_hits += o.refraction_hits;
        self.shadow += o.shadow;
        self.shadow_hits += o.shadow_hits;
    }
}
