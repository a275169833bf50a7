"""Programs of other packages that need not be installed: where they are, or how to install them."""
import roslib.packages
import rospkg

HOW_ON_DEBIAN = {
    'joy': 'Debian has none: build joystick_drivers from source, or publish sensor_msgs/Joy '
           'yourself and start with joy:=false',
    'turtlebot3_gazebo': 'Debian has none: sim:=true is the embedded robot',
    'rviz': 'Debian: sudo apt install rviz',
    'rosbag': 'Debian: sudo apt install python3-rosbag',
}


def path_of(package, what):
    """The path of a node of `package`, or of its folder if `what` is a launch file; '' where it is
    not installed."""
    try:
        if what.endswith('.launch'):
            return rospkg.RosPack().get_path(package)
        return (roslib.packages.find_node(package, what) or [''])[0]
    except rospkg.ResourceNotFound:
        return ''


def how_to_install(package):
    """One sentence for a package that is not installed."""
    return 'the package {} is not installed: sudo apt install ros-noetic-{} ({})'.format(
        package, package.replace('_', '-'), HOW_ON_DEBIAN.get(package, 'Debian has none'))
