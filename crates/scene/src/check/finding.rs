//! What a finding says: kind, severity, element, numbers, words.

/// What is wrong, in the order of reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Lengths or light of another order of magnitude than rooms have.
    Units,
    /// Surfaces that turn their backs to the light.
    FlippedNormals,
    /// Narrow gaps through which light escapes.
    Leak,
    /// Bodies with small holes.
    OpenShell,
    /// Surfaces twice in one place.
    CoplanarDuplicates,
    /// Triangles without area.
    DegenerateTriangles,
    /// Reflectance beyond what paint has.
    BrightAlbedo,
    /// Light from hardly any area.
    TinyEmitter,
    /// No second texture coordinates.
    Uv2Missing,
    /// A place on the lightmap used twice.
    Uv2Overlap,
    /// Second texture coordinates outside of [0, 1].
    Uv2Outside,
    /// Surfaces without area on the lightmap.
    Uv2Degenerate,
    /// Charts too near each other.
    Uv2Padding,
    /// Texels of very different sizes.
    TexelDensity,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Kind; 14] = [
        Kind::Units,
        Kind::FlippedNormals,
        Kind::Leak,
        Kind::OpenShell,
        Kind::CoplanarDuplicates,
        Kind::DegenerateTriangles,
        Kind::BrightAlbedo,
        Kind::TinyEmitter,
        Kind::Uv2Missing,
        Kind::Uv2Overlap,
        Kind::Uv2Outside,
        Kind::Uv2Degenerate,
        Kind::Uv2Padding,
        Kind::TexelDensity,
    ];

    /// The name that options and reports use; it does not change.
    pub fn id(self) -> &'static str {
        match self {
            Kind::Units => "units",
            Kind::FlippedNormals => "flipped-normals",
            Kind::Leak => "leak",
            Kind::OpenShell => "open-shell",
            Kind::CoplanarDuplicates => "coplanar-duplicates",
            Kind::DegenerateTriangles => "degenerate-triangles",
            Kind::BrightAlbedo => "bright-albedo",
            Kind::TinyEmitter => "tiny-emitter",
            Kind::Uv2Missing => "uv2-missing",
            Kind::Uv2Overlap => "uv2-overlap",
            Kind::Uv2Outside => "uv2-outside",
            Kind::Uv2Degenerate => "uv2-degenerate",
            Kind::Uv2Padding => "uv2-padding",
            Kind::TexelDensity => "texel-density",
        }
    }

    /// Why it harms, and what to do.
    pub fn advice(self) -> &'static str {
        match self {
            Kind::Units => "lengths and light levels are not those of rooms: give --unit, or mend the export's scale",
            Kind::FlippedNormals => "light dies on backs of one-sided surfaces: turn them round, or use --two-sided",
            Kind::Leak => "light is lost through gaps nobody meant: close them",
            Kind::OpenShell => "a hole lets light in or out of a body: close it",
            Kind::CoplanarDuplicates => "only one of two surfaces in one place gets light: remove or move the other",
            Kind::DegenerateTriangles => "they get no light and no texel: remove them",
            Kind::BrightAlbedo => "light takes very many bounces to die: paint is below 0.9, fresh snow reaches it",
            Kind::TinyEmitter => "few rays find it, which shows as bright dots: use a light without area",
            Kind::Uv2Missing => "a lightmap needs an unwrapping: baking makes one, or add a second UV set",
            Kind::Uv2Overlap => "a texel has one light for several places: unwrap again without overlaps",
            Kind::Uv2Outside => "there are no texels outside of [0, 1]: scale the unwrapping into it",
            Kind::Uv2Degenerate => "surfaces without area on the lightmap keep one light for all of them: unwrap again",
            Kind::Uv2Padding => "filters mix the light of neighbouring charts: pack with a larger margin",
            Kind::TexelDensity => {
                "shadows are blurred where texels are large and texels wasted where small: unwrap evenly"
            }
        }
    }
}

/// How bad it is, worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Light will be wrong there.
    Error,
    /// Light may be wrong there.
    Warning,
    /// To be known.
    Note,
}

impl Severity {
    /// In reports.
    pub fn id(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        }
    }
}

/// What a finding is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Element {
    /// All of it.
    Scene,
    /// A mesh, by its index and name.
    Mesh(usize, String),
    /// A placed mesh.
    Instance(usize, String),
    /// A material.
    Material(usize, String),
    /// A light without area.
    Light(usize, String),
}

impl std::fmt::Display for Element {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Element::Scene => write!(f, "scene"),
            Element::Mesh(i, name) => write!(f, "mesh {i} \"{name}\""),
            Element::Instance(i, name) => write!(f, "instance {i} \"{name}\""),
            Element::Material(i, name) => write!(f, "material {i} \"{name}\""),
            Element::Light(i, name) => write!(f, "light {i} \"{name}\""),
        }
    }
}

/// The number that decides, and its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// The number.
    pub value: f64,
    /// Its unit, such as `m`.
    pub unit: &'static str,
}

/// Something that ruins a bake, or may.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What is wrong.
    pub kind: Kind,
    /// How bad it is.
    pub severity: Severity,
    /// Where.
    pub element: Element,
    /// How many: triangles, edges, rays; the message says of what.
    pub count: usize,
    /// Area concerned, m².
    pub area: f64,
    /// The number that decided.
    pub worst: Worst,
    /// What was found, with numbers.
    pub message: String,
    /// Triangles of the [`PatchScene`](crate::PatchScene) concerned, ascending.
    pub triangles: Vec<u32>,
}
