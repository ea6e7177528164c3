"""From a scene to a model: the only place where names become objects and numbers.

Needs no Taichi: `softsim check` answers at once. Whatever is wrong with a scene beyond its schema
is said here, at the key that says it.
"""

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np
import yaml

from softsim.errors import MeshError, SceneError
from softsim.loads import profile as profiles
from softsim.loads.profile import Profile
from softsim.loads.vibration import RotorData, eccentric_mass, sinusoidal_force
from softsim.materials.material import (
    DEFAULT_BULK_RATIO,
    Material,
    bulk_modulus_from_poisson_ratio,
    maxwell_branches,
)
from softsim.materials.yeoh import Yeoh
from softsim.mesh.mesh import Mesh, signed_volumes, transformed
from softsim.mesh.quality import check
from softsim.mesh.reading import read_mesh
from softsim.model import (
    Body,
    ContactData,
    Model,
    NodalLoad,
    OutlineData,
    PressureData,
    RotorLoad,
    WallsData,
)
from softsim.rigid.body import RigidBodyData
from softsim.robots.block import block
from softsim.robots.pfr import pfr_section
from softsim.scene import schema
from softsim.scene.loading import LoadedScene
from softsim.solver.time_step import stable_increment

GENERATORS: dict[str, Callable[..., Mesh]] = {"block": block, "pfr_section": pfr_section}
PROFILES: dict[str, Callable[..., Profile]] = {
    "cycles": profiles.cycles,
    "natural_deflation": profiles.natural_deflation,
    "constant": profiles.constant,
}
# A node may start this far inside a wall: rounding of a shape that just fits.
ALLOWED_PENETRATION = 1e-9
ROW_NAME = re.compile(r"j\d+")


def build_model(loaded: LoadedScene) -> Model:
    """The frozen model of a scene.

    Raises
    ------
    SceneError: a name that does not exist, a mesh that cannot be computed with, an open chamber, a
    body that starts inside a wall, a time step above the stable one.
    """
    return _Builder(loaded).build()


def library_material(name: str) -> schema.YeohMaterial | None:
    """The material `name` of the library, or None."""
    entry = _library().get(name)
    return None if entry is None else schema.YeohMaterial.model_validate(entry)


def library_names() -> list[str]:
    """Names in the material library."""
    return list(_library())


def _library() -> dict[str, Any]:
    text = resources.files("softsim.materials").joinpath("library.yaml").read_text("utf-8")
    return yaml.safe_load(text)


@dataclass(frozen=True)
class _Part:
    """A body's mesh, placed, and where its nodes begin."""

    mesh: Mesh
    first_node: int


class _Builder:
    """Builds one model; a method for each part of it."""

    def __init__(self, loaded: LoadedScene) -> None:
        self.loaded, self.scene = loaded, loaded.scene
        self.parts: dict[str, _Part] = {}

    def build(self) -> Model:
        scene = self.scene
        bodies = tuple(self.body(name, data) for name, data in scene.bodies.items())
        rigid_names = list(scene.rigid_bodies)
        points = np.concatenate([b.points for b in bodies])
        soft_count = len(points)
        corners, corner_owner = self.outline_corners()
        points = np.concatenate([points, corners])

        mass = np.zeros(len(points))
        velocity = np.zeros_like(points)
        for b in bodies:
            area = signed_volumes(b.points, b.cells)
            third = b.material.density * b.thickness * area / 3.0
            mass[b.nodes] = np.bincount(b.cells.ravel(), np.repeat(third, 3))
            velocity[b.nodes] = scene.bodies[b.name].initial_velocity

        is_free = np.ones(len(points), dtype=bool)
        is_free[soft_count:] = False
        for name in scene.bodies:
            for k, set_name in enumerate(scene.bodies[name].fixed):
                is_free[self.node_set(f"{name}.{set_name}", ("bodies", name, "fixed", k))] = False
        tied = self.tied_nodes(is_free)
        for nodes in tied:
            is_free[nodes] = False
        velocity[~is_free] = 0.0
        rigid_bodies = tuple(
            self.rigid_body(
                name, np.concatenate([tied[r], soft_count + np.flatnonzero(corner_owner == r)])
            )
            for r, name in enumerate(rigid_names)
        )
        stiffness = self.penalty_stiffness(bodies, len(points))
        effective_mass = contact_mass(points, mass, is_free, rigid_bodies)
        contact = self.contact(
            np.concatenate(
                [*(b.node_sets["surface"] for b in bodies), np.arange(soft_count, len(points))]
            ),
            stiffness, effective_mass, scene.contact.friction_coefficient,
        )  # fmt: skip
        self.refuse_penetration(points, contact.nodes)
        outlines = tuple(
            self.outline(r, name, points, stiffness, effective_mass, tied)
            for r, name in enumerate(rigid_names)
            if scene.rigid_bodies[name].outline is not None
        )
        environment = scene.environment
        slope = environment.inclination
        rows = {
            f"{b.name}.{name}": nodes
            for b in bodies
            for name, nodes in b.node_sets.items()
            if ROW_NAME.fullmatch(name)
        }
        model = Model(
            bodies=bodies,
            points=points,
            velocity=velocity,
            mass=mass,
            is_free=is_free,
            rigid_bodies=rigid_bodies,
            outlines=outlines,
            walls=self.walls(),
            contact=contact,
            pressures=self.pressures(tied),
            rotors=self.rotors(),
            nodal_loads=self.nodal_loads(is_free),
            gravity=environment.gravity * np.array([-np.sin(slope), -np.cos(slope)]),
            rows=rows,
            end_time=scene.time.end,
            increment=None if scene.time.increment == "auto" else scene.time.increment,
            safety_factor=scene.solver.safety_factor,
            bulk_viscosity=scene.solver.bulk_viscosity,
            energy_error_limit=scene.solver.energy_error_limit,
        )
        self.refuse_instant_relaxation(model)
        self.refuse_unstable_increment(model)
        return model

    # --- bodies and materials --------------------------------------------------------------------

    def body(self, name: str, data: schema.Body) -> Body:
        path = ("bodies", name, "mesh")
        first_node = sum(len(p.mesh.points) for p in self.parts.values())
        try:
            mesh = self.mesh(name, data)
            check(mesh)
        except MeshError as error:
            raise self.loaded.error(path, error.message, error.hint) from None
        if mesh.cells.shape[1] != 3:
            raise self.loaded.error(
                path, f"{data.formulation} needs triangles; this mesh has other cells",
                "mesh the section with linear triangles",
            )  # fmt: skip
        mesh = transformed(mesh, data.rotation, np.array(data.position))
        self.parts[name] = _Part(mesh, first_node)
        return Body(
            name=name,
            first_node=first_node,
            points=mesh.points,
            cells=mesh.cells,
            thickness=data.thickness,
            material=self.material(data.material, ("bodies", name, "material")),
            node_sets={k: first_node + v for k, v in mesh.node_sets.items()},
            facet_sets={k: first_node + v for k, v in mesh.facet_sets.items()},
        )

    def mesh(self, name: str, data: schema.Body) -> Mesh:
        source = data.mesh
        if isinstance(source, schema.FileMesh):
            return read_mesh(
                self.loaded.resolve_file(("bodies", name, "mesh", "file")), source.length_unit
            )
        return GENERATORS[source.generator](**source.model_dump(exclude={"generator"}))

    def material(self, name: str, path: tuple[str | int, ...]) -> Material:
        data = self.scene.materials.get(name) or library_material(name)
        if data is None:
            known = [*self.scene.materials, *library_names()]
            raise self.loaded.error(
                path, f"there is no material '{name}'", _close_names(name, known, "materials")
            )
        law = Yeoh(data.C10, data.C20, data.C30)
        mu0 = law.initial_shear_modulus
        if data.bulk_modulus is not None:
            kappa = data.bulk_modulus
        elif data.D1 is not None:
            kappa = 2.0 / data.D1
        elif data.poisson_ratio is not None:
            kappa = bulk_modulus_from_poisson_ratio(mu0, data.poisson_ratio)
        else:
            kappa = DEFAULT_BULK_RATIO * mu0
        branches = maxwell_branches(mu0, [(p.g, p.relaxation_time) for p in data.prony])
        return Material(name, law, kappa, data.density, branches)

    # --- names -----------------------------------------------------------------------------------

    def part(self, reference: str, path: tuple[str | int, ...]) -> tuple[_Part, str]:
        body, dot, name = reference.partition(".")
        if not dot or body not in self.parts:
            raise self.loaded.error(
                path,
                f"'{reference}' names no set of a body",
                f'write body.set, such as "{next(iter(self.parts))}.surface"; '
                f"bodies: {', '.join(self.parts)}",
            )
        return self.parts[body], name

    def node_set(self, reference: str, path: tuple[str | int, ...]) -> np.ndarray:
        part, name = self.part(reference, path)
        return part.first_node + self.member(part.mesh.node_sets, reference, name, path, "node")

    def facet_set(self, reference: str, path: tuple[str | int, ...]) -> np.ndarray:
        part, name = self.part(reference, path)
        return part.first_node + self.member(part.mesh.facet_sets, reference, name, path, "facet")

    def member(
        self,
        sets: Mapping[str, np.ndarray],
        reference: str,
        name: str,
        path: tuple[str | int, ...],
        kind: str,
    ) -> np.ndarray:
        if name not in sets:
            raise self.loaded.error(
                path,
                f"there is no {kind} set '{reference}'",
                _close_names(name, list(sets), f"{kind} sets"),
            )
        return sets[name]

    def rigid_number(self, name: str, path: tuple[str | int, ...]) -> int:
        names = list(self.scene.rigid_bodies)
        if name not in names:
            raise self.loaded.error(
                path,
                f"there is no rigid body '{name}'",
                _close_names(name, names, "rigid bodies"),
            )
        return names.index(name)

    # --- rigid bodies ----------------------------------------------------------------------------

    def outline_corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners of all outlines (k, 2) and the number of the rigid body of each (k,)."""
        corners, owners = [np.zeros((0, 2))], [np.zeros(0, dtype=int)]
        for r, data in enumerate(self.scene.rigid_bodies.values()):
            if data.outline is not None:
                half = 0.5 * np.array([data.outline.length, data.outline.height])
                signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
                corners.append(np.array(data.center) + signs * half)
                owners.append(np.full(4, r))
        return np.concatenate(corners), np.concatenate(owners)

    def tied_nodes(self, is_free: np.ndarray) -> list[np.ndarray]:
        """Soft nodes tied to each rigid body; a node belongs to one body and is not fixed."""
        taken = ~is_free
        result = []
        for name, data in self.scene.rigid_bodies.items():
            nodes = np.zeros(0, dtype=int)
            for k, reference in enumerate(data.tied):
                path = ("rigid_bodies", name, "tied", k)
                chosen = self.node_set(reference, path)
                if taken[chosen].any():
                    raise self.loaded.error(
                        path,
                        f"a node of '{reference}' is already fixed or tied to another rigid body",
                        "a node follows one master only",
                    )
                nodes = np.union1d(nodes, chosen)
            taken[nodes] = True
            result.append(nodes)
        return result

    def rigid_body(self, name: str, tied: np.ndarray) -> RigidBodyData:
        data = self.scene.rigid_bodies[name]
        started = {
            "x": ("initial_velocity", data.initial_velocity[0]),
            "y": ("initial_velocity", data.initial_velocity[1]),
            "rotation": ("initial_angular_velocity", data.initial_angular_velocity),
        }
        for direction, (key, speed) in started.items():
            if direction not in data.free and speed != 0.0:
                raise self.loaded.error(
                    ("rigid_bodies", name, key),
                    f"'{name}' starts to move in {direction}, which is not among its free "
                    "directions",
                    f"add {direction} to rigid_bodies.{name}.free, or start it at rest",
                )
        return RigidBodyData(
            name=name,
            mass=data.mass,
            inertia=data.inertia,
            centre=np.array(data.center),
            tied=tied,
            velocity=np.array(data.initial_velocity),
            angular_velocity=data.initial_angular_velocity,
            free=("x" in data.free, "y" in data.free, "rotation" in data.free),
        )

    def outline(
        self,
        r: int,
        name: str,
        points: np.ndarray,
        stiffness: np.ndarray,
        effective_mass: np.ndarray,
        tied: list[np.ndarray],
    ) -> OutlineData:
        data = self.scene.rigid_bodies[name]
        assert data.outline is not None
        path = ("rigid_bodies", name, "supports")
        sets = [self.node_set(s, (*path, k)) for k, s in enumerate(data.supports)]
        # Tied nodes move with the body and cannot lie against it.
        nodes = np.setdiff1d(np.concatenate([np.zeros(0, dtype=int), *sets]), tied[r])
        support = None
        if len(nodes):
            support = self.contact(
                nodes, stiffness, effective_mass, data.support_friction_coefficient
            )
        half = 0.5 * np.array([data.outline.length, data.outline.height])
        depth = (half - np.abs(points[nodes] - data.center)).min(axis=1)
        if len(nodes) and depth.max() > ALLOWED_PENETRATION:
            x, y = points[nodes[depth.argmax()]] * 1e3
            raise self.loaded.error(
                path,
                f"a node at ({x:.2f}, {y:.2f}) mm starts {depth.max() * 1e3:.3g} mm inside the "
                f"outline of '{name}'",
                "supports lie against the outline from outside: shrink it, or move the body",
            )
        return OutlineData(r, half, np.array(data.center), support)

    # --- contact ---------------------------------------------------------------------------------

    def penalty_stiffness(self, bodies: Sequence[Body], node_count: int) -> np.ndarray:
        """k_n of every node [N/m]: the user's, or the bulk modulus times the thickness.

        That is the stiffness of one element across its own size: a contact as stiff as the solid
        behind it, whatever the mesh.
        """
        given = self.scene.contact.penalty_stiffness
        stiffest = max(b.material.bulk_modulus * b.thickness for b in bodies)
        stiffness = np.full(node_count, stiffest if given == "auto" else given)
        if given == "auto":
            for b in bodies:
                stiffness[b.nodes] = b.material.bulk_modulus * b.thickness
        return stiffness

    def contact(
        self,
        nodes: np.ndarray,
        stiffness: np.ndarray,
        effective_mass: np.ndarray,
        friction_coefficient: float,
    ) -> ContactData:
        """Contact data of `nodes`; the dashpot is the share `damping_ratio` of critical damping."""
        settings = self.scene.contact
        k_n, m = stiffness[nodes], effective_mass[nodes]
        moving = np.where(np.isfinite(m), m, 0.0)  # a fixed node needs no dashpot
        return ContactData(
            nodes=nodes,
            penalty_stiffness=k_n,
            tangential_stiffness=settings.tangential_stiffness_ratio * k_n,
            damping=2.0 * settings.damping_ratio * np.sqrt(k_n * moving),
            effective_mass=m,
            friction_coefficient=friction_coefficient,
        )

    def walls(self) -> WallsData:
        names, points, normals = [], [], []
        for name, wall in self.scene.environment.walls.items():
            if isinstance(wall, schema.PipeWall):
                for side, sign in (("top", 1.0), ("bottom", -1.0)):
                    names.append(f"{name}.{side}")
                    points.append([0.0, wall.axis_height + sign * 0.5 * wall.diameter])
                    normals.append([0.0, -sign])
            else:
                normal = np.array(wall.normal)
                names.append(name)
                points.append(list(wall.point))
                normals.append(list(normal / np.linalg.norm(normal)))
        return WallsData(
            tuple(names),
            np.array(points, dtype=float).reshape(-1, 2),
            np.array(normals, dtype=float).reshape(-1, 2),
        )

    def refuse_penetration(self, points: np.ndarray, nodes: np.ndarray) -> None:
        walls = self.walls()
        for name, point, normal in zip(walls.names, walls.points, walls.normals, strict=True):
            gaps = (points[nodes] - point) @ normal
            worst = int(np.argmin(gaps))
            if gaps[worst] < -ALLOWED_PENETRATION:
                x, y = points[nodes[worst]] * 1e3
                wall = name.partition(".")[0]
                data = self.scene.environment.walls[wall]
                key = "diameter" if isinstance(data, schema.PipeWall) else "point"
                raise self.loaded.error(
                    ("environment", "walls", wall, key),
                    f"wall '{wall}' starts {-gaps[worst] * 1e3:.3g} mm inside the body, deepest at "
                    f"({x:.2f}, {y:.2f}) mm",
                    self.fitting_hint(data, points[nodes]),
                )

    def fitting_hint(self, wall: Any, points: np.ndarray) -> str:
        if isinstance(wall, schema.PipeWall):
            widest = 2.0 * np.abs(points[:, 1] - wall.axis_height).max()
            enough = np.ceil((widest - ALLOWED_PENETRATION) * 1e6) / 1e3  # mm, up to a micrometre
            return f"a pipe that takes it has a diameter of at least {enough:g} mm"
        return "move the wall or the body so that they do not overlap"

    # --- loads -----------------------------------------------------------------------------------

    def pressures(self, tied: list[np.ndarray]) -> tuple[PressureData, ...]:
        result = []
        for name, load in self.scene.loads.items():
            if not isinstance(load, schema.FollowerPressure):
                continue
            path = ("loads", name)
            facets = [self.facet_set(f, (*path, "facets", k)) for k, f in enumerate(load.facets)]
            body = None
            if load.reacts_on is not None:
                body = self.rigid_number(load.reacts_on, (*path, "reacts_on"))
                chamber = np.concatenate(facets)
                self.refuse_open_chamber(chamber, tied[body], load.reacts_on, (*path, "facets"))
            self.refuse_repeated_facets(np.concatenate(facets), (*path, "facets"))
            owners = {f.partition(".")[0] for f in load.facets}
            thicknesses = {self.scene.bodies[o].thickness for o in owners}
            if len(thicknesses) > 1:
                raise self.loaded.error(
                    (*path, "facets"), "the facets belong to bodies of different thickness",
                    "give each body a load of its own",
                )  # fmt: skip
            profile = pressure_profile(load.profile)
            section = profile.reduced(load.factor, load.offset)
            result.append(
                PressureData(
                    name, np.concatenate(facets), thicknesses.pop(), profile, section, body
                )
            )
        return tuple(result)

    def refuse_repeated_facets(self, facets: np.ndarray, path: tuple[str | int, ...]) -> None:
        """A facet in two of the sets would carry the pressure twice."""
        _, counts = np.unique(facets, axis=0, return_counts=True)
        if counts.max() > 1:
            raise self.loaded.error(
                path,
                f"{int((counts > 1).sum())} facet(s) are in more than one of these sets: the "
                "pressure would act on them twice",
                "name each part of the surface once",
            )

    def refuse_open_chamber(
        self, facets: np.ndarray, tied: np.ndarray, body: str, path: tuple[str | int, ...]
    ) -> None:
        """The chain of facets must begin and end on the rigid body, or be a ring."""
        nodes, counts = np.unique(facets, return_counts=True)
        loose = np.setdiff1d(nodes[counts == 1], tied)
        if len(loose):
            x, y = self.point_of(int(loose[0])) * 1e3
            raise self.loaded.error(
                path,
                f"the chamber is open: its facets end at ({x:.2f}, {y:.2f}) mm, where nothing is "
                f"tied to '{body}'",
                f"tie both ends to '{body}' (rigid_bodies.{body}.tied), or choose facets that "
                "reach from one tied end to the other",
            )

    def point_of(self, node: int) -> np.ndarray:
        for part in self.parts.values():
            if node < part.first_node + len(part.mesh.points):
                return part.mesh.points[node - part.first_node]
        raise IndexError(node)

    def rotors(self) -> tuple[RotorLoad, ...]:
        result = []
        for name, load in self.scene.loads.items():
            if isinstance(load, schema.EccentricMass):
                rotor = eccentric_mass(
                    load.factor * load.eccentric_mass, load.radius, load.frequency,
                    load.rotation_axis, load.spin_up, load.phase,
                )  # fmt: skip
            elif isinstance(load, schema.SinusoidalForce):
                rotor = self.sinusoid(load)
            else:
                continue
            body = self.rigid_number(load.acts_on, ("loads", name, "acts_on"))
            result.append(RotorLoad(body, rotor))
        return tuple(result)

    def sinusoid(self, load: schema.SinusoidalForce) -> RotorData:
        return sinusoidal_force(
            load.amplitude, np.array(load.direction), load.frequency, load.spin_up, load.phase
        )

    def nodal_loads(self, is_free: np.ndarray) -> tuple[NodalLoad, ...]:
        result = []
        for name, load in self.scene.loads.items():
            if isinstance(load, schema.NodalForce):
                path = ("loads", name, "nodes")
                nodes = self.node_set(load.nodes, path)
                if not is_free[nodes].all():
                    raise self.loaded.error(
                        path,
                        f"a node of '{load.nodes}' is fixed or tied: a force on it moves nothing",
                        "load free nodes, or put the load on the rigid body",
                    )
                result.append(NodalLoad(nodes, np.array(load.force), load.ramp))
        return tuple(result)

    # --- time ------------------------------------------------------------------------------------

    def refuse_instant_relaxation(self, model: Model) -> None:
        """A branch that relaxes within a hundredth of an increment carries no load, yet its
        dissipation could no longer be computed.
        """
        step = stable_increment(model, model.points).value
        for body in model.bodies:
            for branch in body.material.branches:
                if branch.relaxation_time < 0.01 * step:
                    raise self.loaded.error(
                        ("bodies", body.name, "material"),
                        f"material '{body.material.name}' relaxes in "
                        f"{branch.relaxation_time * 1e6:.3g} us, far within a time step of "
                        f"{step * 1e6:.3g} us",
                        "leave out prony terms shorter than the time step",
                    )

    def refuse_unstable_increment(self, model: Model) -> None:
        if model.increment is None:
            return
        stable = stable_increment(model, model.points)
        if model.increment > stable.value:
            raise self.loaded.error(
                ("time", "increment"),
                f"the time step {model.increment * 1e6:.3g} us is above the stable one, "
                f"{stable.describe()}",
                f'write "auto", or at most {np.floor(model.safety_factor * stable.value * 1e9):g}'
                " ns",
            )


def contact_mass(
    points: np.ndarray,
    mass: np.ndarray,
    is_free: np.ndarray,
    rigid_bodies: Sequence[RigidBodyData],
) -> np.ndarray:
    """The mass that a contact at each node has to move (n,) [kg].

    A free node: its own. A node of a rigid body: 1/m = 1/M + r^2/I, its worst direction. A fixed
    node: infinite.
    """
    effective = np.where(is_free, mass, np.inf)
    for body in rigid_bodies:
        arm_squared = ((points[body.tied] - body.centre) ** 2).sum(axis=1)
        effective[body.tied] = 1.0 / (1.0 / body.mass + arm_squared / body.inertia)
    return effective


def pressure_profile(data: schema.PressureProfile) -> Profile:
    """The profile [Pa over s] that a scene describes."""
    if isinstance(data, schema.TableProfile):
        return Profile(*np.array(data.points, dtype=float).T)
    return PROFILES[data.kind](**data.model_dump(exclude={"kind"}))


def _close_names(name: str, known: list[str], kind: str) -> str:
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    listed = ", ".join(known) if known else "none"
    meant = f"did you mean {' or '.join(repr(c) for c in close)}? " if close else ""
    return f"{meant}{kind}: {listed}"


__all__ = ["SceneError", "build_model", "library_material", "library_names", "pressure_profile"]
