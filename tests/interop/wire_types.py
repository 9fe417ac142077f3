"""The types of idl/mes.idl and of the ROS 2 messages, written by hand for Cyclone DDS: an independent reading of the wire format.

`@final` because fastddsgen 2.3 emits plain XCDR1, whatever an annotation says (docs/topics.md).
"""

from dataclasses import dataclass
from enum import auto

import cyclonedds.idl as idl
import cyclonedds.idl.annotations as annotate
import cyclonedds.idl.types as t

MES = "breakshot_mes_msgs.msg.dds_."


class VerbKind(idl.IdlEnum, typename=MES + "VerbKind_"):
    STORE = 0
    STORE_AND_START = auto()
    START = auto()
    PAUSE = auto()
    RESUME = auto()
    CANCEL = auto()
    STOP = auto()
    ABORT = auto()
    CLEAR = auto()
    RESET = auto()
    SET_MODE = auto()
    ACK_ALARM = auto()
    ACK_RESULT = auto()
    QUERY = auto()


class VerdictKind(idl.IdlEnum, typename=MES + "VerdictKind_"):
    ACCEPTED = 0
    REJECTED = auto()
    DUPLICATE = auto()


class JobPhase(idl.IdlEnum, typename=MES + "JobPhase_"):
    NOT_ALLOWED_TO_START = 0
    ALLOWED_TO_START = auto()
    RUNNING = auto()
    INTERRUPTED = auto()
    ENDED = auto()
    ABORTED = auto()


@dataclass
@annotate.final
class MsgHeader(idl.IdlStruct, typename=MES + "MsgHeader_"):
    robot_id: t.uint32
    ver_major: t.uint16
    ver_minor: t.uint16
    source_id: t.array[t.byte, 16]
    session: t.uint64
    seq: t.uint64
    stamp_utc_ns: t.int64


@dataclass
@annotate.final
class JobSpec(idl.IdlStruct, typename=MES + "JobSpec_"):
    min_gap_m: t.float64
    region_xyxy_m: t.array[t.float64, 4]
    expect_discs: t.uint32
    max_hits: t.uint32
    max_pushes: t.uint32
    timeout_ms: t.uint32
    speed_scale: t.float64


# Enumerations other than those that a test names travel as uint32: the same bytes.
@dataclass
@annotate.final
@annotate.autoid("sequential")
class JobCommand(idl.IdlStruct, typename=MES + "JobCommand_"):
    robot_id: t.uint32
    annotate.key("robot_id")
    hdr: MsgHeader
    command_id: t.array[t.byte, 16]
    order_id: t.array[t.byte, 16]
    order_rev: t.uint32
    verb: VerbKind
    mode: t.uint32
    valid_for_ms: t.uint32
    auth_level: t.uint8
    operator_id: t.bounded_str[64]
    spec: JobSpec


@dataclass
@annotate.final
class CommandAck(idl.IdlStruct, typename=MES + "CommandAck_"):
    robot_id: t.uint32
    annotate.key("robot_id")
    hdr: MsgHeader
    command_id: t.array[t.byte, 16]
    order_id: t.array[t.byte, 16]
    order_rev: t.uint32
    verdict: VerdictKind
    reason: t.uint32
    detail: t.uint32
    state: t.uint32
    text: t.bounded_str[128]


@dataclass
@annotate.final
class JobState(idl.IdlStruct, typename=MES + "JobState_"):
    robot_id: t.uint32
    annotate.key("robot_id")
    slot: t.uint32
    annotate.key("slot")
    hdr: MsgHeader
    order_id: t.array[t.byte, 16]
    order_rev: t.uint32
    phase: JobPhase
    change_no: t.uint32
    progress: t.float32
    discs_seen: t.uint32
    discs_singulated: t.uint32
    hits: t.uint32
    pushes: t.uint32
    t_accepted_ns: t.int64
    t_started_ns: t.int64
    t_ended_ns: t.int64
    min_gap_m: t.float64
    result: t.uint32
    text: t.bounded_str[128]


@dataclass
@annotate.final
class Time(idl.IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: t.int32
    nanosec: t.uint32


@dataclass
@annotate.final
class Header(idl.IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time
    frame_id: str


@dataclass
@annotate.final
class RosJointState(idl.IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    header: Header
    name: t.sequence[str]
    position: t.sequence[t.float64]
    velocity: t.sequence[t.float64]
    effort: t.sequence[t.float64]


@dataclass
@annotate.final
class RosImage(idl.IdlStruct, typename="sensor_msgs.msg.dds_.Image_"):
    header: Header
    height: t.uint32
    width: t.uint32
    encoding: str
    is_bigendian: t.uint8
    step: t.uint32
    data: t.sequence[t.uint8]


@dataclass
@annotate.final
class Point(idl.IdlStruct, typename="geometry_msgs.msg.dds_.Point_"):
    x: t.float64
    y: t.float64
    z: t.float64


@dataclass
@annotate.final
class Quaternion(idl.IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x: t.float64
    y: t.float64
    z: t.float64
    w: t.float64


@dataclass
@annotate.final
class Pose(idl.IdlStruct, typename="geometry_msgs.msg.dds_.Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
@annotate.final
class Vector3(idl.IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x: t.float64
    y: t.float64
    z: t.float64


@dataclass
@annotate.final
class ColorRGBA(idl.IdlStruct, typename="std_msgs.msg.dds_.ColorRGBA_"):
    r: t.float32
    g: t.float32
    b: t.float32
    a: t.float32


@dataclass
@annotate.final
class Duration(idl.IdlStruct, typename="builtin_interfaces.msg.dds_.Duration_"):
    sec: t.int32
    nanosec: t.uint32


@dataclass
@annotate.final
class CompressedImage(idl.IdlStruct, typename="sensor_msgs.msg.dds_.CompressedImage_"):
    header: Header
    format: str
    data: t.sequence[t.uint8]


@dataclass
@annotate.final
class UVCoordinate(idl.IdlStruct, typename="visualization_msgs.msg.dds_.UVCoordinate_"):
    u: t.float32
    v: t.float32


@dataclass
@annotate.final
class MeshFile(idl.IdlStruct, typename="visualization_msgs.msg.dds_.MeshFile_"):
    filename: str
    data: t.sequence[t.uint8]


@dataclass
@annotate.final
class Marker(idl.IdlStruct, typename="visualization_msgs.msg.dds_.Marker_"):
    header: Header
    ns: str
    id: t.int32
    type: t.int32
    action: t.int32
    pose: Pose
    scale: Vector3
    color: ColorRGBA
    lifetime: Duration
    frame_locked: t.uint8
    points: t.sequence[Point]
    colors: t.sequence[ColorRGBA]
    texture_resource: str
    texture: CompressedImage
    uv_coordinates: t.sequence[UVCoordinate]
    text: str
    mesh_resource: str
    mesh_file: MeshFile
    mesh_use_embedded_materials: t.uint8


@dataclass
@annotate.final
class MarkerArray(idl.IdlStruct, typename="visualization_msgs.msg.dds_.MarkerArray_"):
    markers: t.sequence[Marker]
