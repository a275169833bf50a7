#!/usr/bin/env python3
"""The embedded robot: it behaves like a TurtleBot3 with its firmware, on the same topics.

Subscribes
    cmd_vel       geometry_msgs/Twist          linear.x [m/s], angular.z [rad/s]
    reset         std_msgs/Empty               the firmware's reset (see simulation/simulator.py)
Publishes (frames are in the node's namespace: robot3/odom in /robot3)
    imu           sensor_msgs/Imu              frame imu_link, ~imu_rate
    odom          nav_msgs/Odometry            odom -> base_footprint, ~odom_rate
    joint_states  sensor_msgs/JointState       with each odometry
    /tf           tf2_msgs/TFMessage           odom -> base_footprint, with each odometry
    /tf_static    tf2_msgs/TFMessage           world -> odom: true place of the odometry's origin
    ground_truth  geometry_msgs/PoseStamped    frame world, 50 Hz: for tests, never for control
    /clock        rosgraph_msgs/Clock          with use_sim_time, 200 per simulated second
    The network (~network) delays imu, odom, joint_states and /tf. Messages of one topic that were
    delayed together are sent to each subscriber in one write.
Parameters
    ~speed        pace of /clock, times real time, with use_sim_time (1)
    ~robots       0: one robot, in this node's namespace; else the number of robots, in the
                  namespaces robot1, robot2, ... (0)
    ~first_robot  number of the first robot (1)
    ~spacing      distance of two neighbours, along y [m] (1)
    ~network      quiet, good, busy, bad: a set of network settings (simulation/network.py); a
                  setting that is given itself takes precedence (quiet)
    ~model        burger, waffle, waffle_pi (TURTLEBOT3_MODEL in the environment, else burger)
    all others    fields of SimulatorConfig (simulation/simulator_config.py), with unit, bounds and
                  default. All but the start's may change while it runs, for all robots:
                  rosrun dynamic_reconfigure dynparam set /turtlebot3 network_cut true
"""
from dataclasses import dataclass, replace

from tf2_ros import StaticTransformBroadcaster

from tb3_labs.config import Config, setting
from tb3_labs.ros.node import run
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.reconfigure import LiveSettings
from tb3_labs.ros.robot.fake_robot import FakeRobot
from tb3_labs.ros.robot.pacemaker import Pacemaker
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator_config import STARTING, SimulatorConfig


@dataclass(frozen=True)
class ClassConfig(Config):
    """Number and places of the robots, the pace of their time, and their network."""

    speed: float = setting(1.0, 'pace of /clock, times real time, with use_sim_time',
                           low=0.1, high=20.0)
    robots: int = setting(0, 'robots, in namespaces robot1, robot2, ...; 0: one in this namespace',
                          low=0, high=200)
    first_robot: int = setting(1, 'number of the first robot', low=1, high=10000)
    spacing: float = setting(1.0, 'distance between neighbours, along y', 'm', 0.0, 100.0)
    network: str = setting('quiet', 'named network between robots and computer',
                           choices=tuple(NETWORKS))


class FakeTurtlebot3:
    """One robot, or several."""

    def __init__(self):
        settings, room = read_config(SimulatorConfig, ClassConfig)
        settings = replace(_on_network(settings, room.network), model=read_model().name)
        static_tf = StaticTransformBroadcaster()
        self._robots = [FakeRobot(settings, static_tf)] if not room.robots else [
            FakeRobot(_in_place(settings, number, room.spacing), static_tf, 'robot%d' % number)
            for number in range(room.first_robot, room.first_robot + room.robots)]
        self._live = LiveSettings(settings, self._on_settings, fixed=STARTING)
        Pacemaker(self._robots, room.speed)

    def _on_settings(self, settings):
        for robot in self._robots:
            robot.configure(settings)


def _in_place(settings, number, spacing):
    """Settings of robot `number`: its place beside the others, and noise of its own."""
    return replace(settings, start_y=settings.start_y + number * spacing,
                   seed=settings.seed + number)


def _on_network(settings, network):
    """`settings` with those of `network`, except where a setting is given already."""
    plain = SimulatorConfig()
    return replace(settings, **{name: value for name, value in NETWORKS[network].items()
                                if getattr(settings, name) == getattr(plain, name)})


if __name__ == '__main__':
    run('turtlebot3', FakeTurtlebot3)
