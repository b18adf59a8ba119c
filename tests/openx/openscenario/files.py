"""Small scenario files and catalogues, in parts."""

from pathlib import Path

BOX = '<BoundingBox><Center x="1.4" y="0" z="0.7"/><Dimensions {size}/></BoundingBox>'
CAR = (
    '<Vehicle name="{name}" vehicleCategory="car">{declared}'
    + BOX.format(size='width="{width}" length="4.5" height="1.5"')
    + '<Performance maxSpeed="{speed}" maxAcceleration="5" maxDeceleration="8"/><Axles>'
    '<FrontAxle maxSteering="0.5" wheelDiameter="0.7" trackWidth="1.7" positionX="2.8" '
    'positionZ="0.3"/><RearAxle maxSteering="0" wheelDiameter="0.7" trackWidth="1.7" '
    'positionX="0" positionZ="0.3"/></Axles></Vehicle>'
)


def parameter(name: str, kind: str, value: str) -> str:
    """Return a declaration."""
    return f'<ParameterDeclaration name="{name}" parameterType="{kind}" value="{value}"/>'


def declared(*parameters: str) -> str:
    """Return declarations together."""
    return f"<ParameterDeclarations>{''.join(parameters)}</ParameterDeclarations>"


def car(name: str = "car", width: str = "1.8", speed: str = "50", declared: str = "") -> str:
    """Return a vehicle."""
    return CAR.format(name=name, width=width, speed=speed, declared=declared)


def reference(catalog: str, entry: str, **assigned: str) -> str:
    """Return a reference to a catalogue's entry."""
    given = "".join(
        f'<ParameterAssignment parameterRef="{name}" value="{value}"/>'
        for name, value in assigned.items()
    )
    inner = f"<ParameterAssignments>{given}</ParameterAssignments>" if given else ""
    return (
        f'<CatalogReference catalogName="{catalog}" entryName="{entry}">{inner}</CatalogReference>'
    )


def catalog(name: str, *entries: str) -> str:
    """Return a catalogue's file."""
    return (
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" date="2025-01-01T00:00:00" '
        f'description="" author=""/><Catalog name="{name}">{"".join(entries)}</Catalog>'
        "</OpenSCENARIO>"
    )


def entity(body: str, name: str = "ego") -> str:
    """Return a participant."""
    return f'<ScenarioObject name="{name}">{body}</ScenarioObject>'


def speed(value: str, name: str = "faster") -> str:
    """Return an event in which somebody reaches a speed at once."""
    return (
        f'<Event name="{name}" priority="overwrite"><Action name="a"><PrivateAction>'
        '<LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="step" '
        'dynamicsDimension="time" value="0"/><SpeedActionTarget>'
        f'<AbsoluteTargetSpeed value="{value}"/></SpeedActionTarget></SpeedAction>'
        "</LongitudinalAction></PrivateAction></Action></Event>"
    )


def story(maneuvers: str, *, declared: str = "", actors: str = "ego") -> str:
    """Return a story of one group."""
    return (
        f'<Story name="s">{declared}<Act name="a"><ManeuverGroup name="g" '
        'maximumExecutionCount="1"><Actors selectTriggeringEntities="false">'
        f'<EntityRef entityRef="{actors}"/></Actors>{maneuvers}</ManeuverGroup></Act></Story>'
    )


def maneuver(*events: str, declared: str = "", name: str = "m") -> str:
    """Return a maneuver."""
    return f'<Maneuver name="{name}">{declared}{"".join(events)}</Maneuver>'


def scenario(
    *,
    declared: str = "",
    entities: str = "",
    init: str = "",
    stories: str = "",
    locations: str = "",
) -> str:
    """Return a scenario's file; its entity is ``ego`` unless others are given."""
    return (
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" date="2025-01-01T00:00:00" '
        f'description="" author=""/>{declared}<CatalogLocations>{locations}</CatalogLocations>'
        f"<RoadNetwork/>\n<Entities>{entities or entity(car())}</Entities>\n"
        f"<Storyboard><Init><Actions>{init}</Actions></Init>{stories}<StopTrigger/></Storyboard>"
        "</OpenSCENARIO>"
    )


def location(kind: str, path: str) -> str:
    """Return where the catalogues of a kind lie."""
    return f'<{kind}Catalog><Directory path="{path}"/></{kind}Catalog>'


def written(folder: Path, **files: str) -> Path:
    """Write files of these stems; return the path of the first."""
    folder.mkdir(parents=True, exist_ok=True)
    for stem, text in files.items():
        (folder / f"{stem}.xosc").write_text(text)
    return folder / f"{next(iter(files))}.xosc"
