!> Joints of shells that pass moments: springs that keep the angle between the two sides of a line
!! at which the mid-surface has no slope in common. docs/shells.md has the formulas.
module shell_joints
  use kinds, only: wp
  use text, only: to_text, rounded_text
  use state_store, only: state_store_t, carry, carry_field
  use block_law, only: block_law_t
  use plane_stress, only: areal_modulus
  use basis_tables, only: n_lanes
  use patch_seams, only: seams_t, collect, sum_groups, distribute
  use element, only: part_t, force_report_t, motion_t
  implicit none
  private

  public :: add_joint_forces, set_rest, set_stiffness, largest_bound, joint_words, carry_joints

  !> A spring turns by what a strip of the sheet does that is so much shorter than the elements, if
  !! the time increment allows it.
  real(wp), parameter, public :: firmness = 100.0_wp

  !> Springs, eight elements of lines side by side; lanes that fill the last block up have no
  !! stiffness. Rows 1 to 3 of an element: the line, and the next row of either side.
  type, public :: shell_joints_t
    integer :: n_lines = 0, n_cells = 0      !! a cell: one element along a line
    integer :: n_nodes = 0, n_points = 0     !! of a row, of a cell; most of all lines
    !> Control points that springs move, those of part p from start(p) to start(p + 1) - 1: their
    !! places, axis 1 fastest, and positions (n, 3). Of seams every part has its own.
    integer, allocatable :: start(:), place(:)
    real(wp), allocatable :: x(:, :)
    integer, allocatable :: node(:, :, :, :) !! of these, shape (8, nodes, 3 rows, n_blocks)
    !> Where in `forces` the first components on control point i are: share(first(i)) and on.
    integer, allocatable :: first(:), share(:)
    !> Weights of the control points in the tangent of the line (nodes, points), shape
    !! (8, nodes, points, n_blocks).
    real(wp), allocatable :: along(:, :, :, :)
    !> The same, of the line and of the next row, in the tangents away from it; (8, nodes, 2 sides,
    !! points, n_blocks).
    real(wp), allocatable :: near(:, :, :, :, :), far(:, :, :, :, :)
    real(wp), allocatable :: rest(:, :, :, :)      !! cosine, sine at the start; (8, 2, points, ...)
    !> Moment per radian of the share of a point [force length], (8, points, n_blocks); and the
    !! most that serves, of a modulus of one.
    real(wp), allocatable :: stiffness(:, :, :), nominal(:, :, :)
    !> Length of the sheet that bends as much as the softest one turns, in elements across the line.
    real(wp) :: softness = 0.0_wp
    real(wp) :: energy = 0.0_wp                    !! stored now
    real(wp), allocatable :: forces(:, :, :, :, :) !! of the cells (8, nodes, 3, 3 rows, n_blocks)
    real(wp), allocatable :: energies(:)           !! of the blocks
  end type shell_joints_t

  !> The angle at a point of eight cells and how it changes: by `turn` of a side times the motion of
  !! its tangent away from the line, and by `lean` times that of the tangent along it.
  type :: turn_t
    real(wp) :: cosine(n_lanes), sine(n_lanes)
    real(wp) :: turn(n_lanes, 3, 2), lean(n_lanes, 3)
  end type turn_t

  !> A number at each control point of a part.
  type :: sums_t
    real(wp), allocatable :: at(:)
  end type sums_t

contains

  !> Set the angles of the present shape as those to be kept.
  subroutine set_rest(joints, parts)
    type(shell_joints_t), intent(inout) :: joints
    type(part_t), intent(in) :: parts(:)
    real(wp) :: u(n_lanes, joints%n_nodes, 3, 3)
    type(turn_t) :: turn
    integer :: q, b

    call gather(joints, parts, 0.0_wp)
    do b = 1, size(joints%energies)
      call read_block(joints%n_nodes, size(joints%x, 1), joints%node(:, :, :, b), joints%x, u)
      do q = 1, joints%n_points
        call find_turn(joints%n_nodes, joints%along(:, :, q, b), joints%near(:, :, :, q, b), &
                       joints%far(:, :, :, q, b), u, turn)
        joints%rest(:, 1, q, b) = turn%cosine
        joints%rest(:, 2, q, b) = turn%sine
      end do
    end do
  end subroutine set_rest

  !> Add the forces of the springs to the internal forces, and their work to the report; of a trial
  !! motion those at its end. Bitwise the same for any number of threads.
  subroutine add_joint_forces(joints, parts, dt, is_trial, report)
    type(shell_joints_t), intent(inout) :: joints
    type(part_t), intent(inout) :: parts(:)
    real(wp), intent(in) :: dt                      !! [time]
    logical, intent(in) :: is_trial
    type(force_report_t), intent(inout) :: report
    integer, parameter :: worth = 16                ! blocks; fewer are not worth waking threads
    real(wp) :: before, ahead
    integer :: b, p

    if (joints%n_cells == 0) return
    ahead = merge(dt, 0.0_wp, is_trial)
    call gather(joints, parts, ahead)
    !$omp parallel do schedule(static) if (size(joints%energies) > worth)
    do b = 1, size(joints%energies)
      call work_block(joints, b)
    end do
    !$omp end parallel do
    do p = 1, size(parts)
      associate (force => parts(p)%element%motion%internal_force)
        call scatter(size(force)/3, size(joints%forces), joints, p, joints%forces, force)
      end associate
    end do
    if (is_trial) return
    before = joints%energy
    joints%energy = sum(joints%energies)
    report%internal_work = report%internal_work + joints%energy - before
  end subroutine add_joint_forces

  !> Forces and energy of a block.
  subroutine work_block(joints, b)
    type(shell_joints_t), intent(inout) :: joints
    integer, intent(in) :: b
    real(wp) :: u(n_lanes, joints%n_nodes, 3, 3)
    integer :: q

    call read_block(joints%n_nodes, size(joints%x, 1), joints%node(:, :, :, b), joints%x, u)
    joints%energies(b) = 0.0_wp
    joints%forces(:, :, :, :, b) = 0.0_wp
    do q = 1, joints%n_points
      call work_point(joints%n_nodes, joints%along(:, :, q, b), joints%near(:, :, :, q, b), &
                      joints%far(:, :, :, q, b), joints%rest(:, :, q, b), &
                      joints%stiffness(:, q, b), u, joints%forces(:, :, :, :, b), &
                      joints%energies(b))
    end do
  end subroutine work_block

  !> The share of a point of each cell.
  pure subroutine work_point(m, along, near, far, rest, stiffness, u, force, energy)
    integer, intent(in) :: m               !! control points of a row
    real(wp), intent(in) :: along(n_lanes, m), near(n_lanes, m, 2), far(n_lanes, m, 2)
    real(wp), intent(in) :: rest(n_lanes, 2), stiffness(n_lanes), u(n_lanes, m, 3, 3)
    real(wp), intent(inout) :: force(n_lanes, m, 3, 3), energy
    type(turn_t) :: turn
    real(wp) :: s, c, moment(n_lanes), stored(n_lanes)
    integer :: l

    call find_turn(m, along, near, far, u, turn)
    !$omp simd private(s, c)
    do l = 1, n_lanes
      ! of the change, so that it is exactly zero at the start
      s = (turn%sine(l) - rest(l, 2))*rest(l, 1) - (turn%cosine(l) - rest(l, 1))*rest(l, 2)
      c = turn%cosine(l)*rest(l, 1) + turn%sine(l)*rest(l, 2)
      moment(l) = stiffness(l)*s
      ! 1 - c, without the loss of digits at small angles
      stored(l) = stiffness(l)*merge(s**2/(1.0_wp + abs(c)), 1.0_wp - c, c > 0.0_wp)
    end do
    energy = energy + sum(stored)
    call expand(m, along, near, far, turn, moment, force)
  end subroutine work_point

  !> Positions of all control points that springs move.
  subroutine gather(joints, parts, ahead)
    type(shell_joints_t), intent(inout) :: joints
    type(part_t), intent(in) :: parts(:)
    real(wp), intent(in) :: ahead          !! time to which positions are carried on [time]
    integer :: p

    do p = 1, size(parts)
      associate (first => joints%start(p), last => joints%start(p + 1) - 1)
        call gather_part(joints%place(first:last), ahead, parts(p)%element%motion, &
                         joints%x(first:last, :))
      end associate
    end do
  end subroutine gather

  pure subroutine gather_part(places, ahead, motion, x)
    integer, intent(in) :: places(:)
    real(wp), intent(in) :: ahead
    type(motion_t), intent(in) :: motion
    real(wp), intent(inout) :: x(:, :)
    integer :: i, j, k, n

    n = size(motion%x, 1)
    do k = 1, size(places)
      j = (places(k) - 1)/n + 1
      i = places(k) - n*(j - 1)
      x(k, :) = motion%x(i, j, 1, :)
      if (ahead > 0.0_wp) x(k, :) = x(k, :) + ahead*motion%v(i, j, 1, :)
    end do
  end subroutine gather_part

  !> Positions of the control points of a block, seen from one of them.
  pure subroutine read_block(m, n, node, x, u)
    integer, intent(in) :: m, n, node(n_lanes, m, 3)
    real(wp), intent(in) :: x(n, 3)
    real(wp), intent(out) :: u(n_lanes, m, 3, 3)
    real(wp) :: from(3)
    integer :: l, i, row

    from = x(node(1, 1, 1), :)
    do row = 1, 3
      do i = 1, m
        !$omp simd
        do l = 1, n_lanes
          u(l, i, 1, row) = x(node(l, i, row), 1) - from(1)
          u(l, i, 2, row) = x(node(l, i, row), 2) - from(2)
          u(l, i, 3, row) = x(node(l, i, row), 3) - from(3)
        end do
      end do
    end do
  end subroutine read_block

  !> The angle at a point of each cell of a block, and how it changes.
  pure subroutine find_turn(m, along, near, far, u, turn)
    integer, intent(in) :: m
    real(wp), intent(in) :: along(n_lanes, m), near(n_lanes, m, 2), far(n_lanes, m, 2)
    real(wp), intent(in) :: u(n_lanes, m, 3, 3)
    type(turn_t), intent(out) :: turn
    real(wp) :: t(n_lanes, 3), g(n_lanes, 3, 2), away(n_lanes, 3, 2), per(n_lanes)
    integer :: i, c, s, l

    t = 0.0_wp
    g = 0.0_wp
    do i = 1, m
      do c = 1, 3
        !$omp simd
        do l = 1, n_lanes
          t(l, c) = t(l, c) + along(l, i)*u(l, i, c, 1)
          g(l, c, 1) = g(l, c, 1) + near(l, i, 1)*u(l, i, c, 1) + far(l, i, 1)*u(l, i, c, 2)
          g(l, c, 2) = g(l, c, 2) + near(l, i, 2)*u(l, i, c, 1) + far(l, i, 2)*u(l, i, c, 3)
        end do
      end do
    end do
    !$omp simd
    do l = 1, n_lanes
      per(l) = 1.0_wp/sqrt(t(l, 1)**2 + t(l, 2)**2 + t(l, 3)**2)
      t(l, 1) = per(l)*t(l, 1)
      t(l, 2) = per(l)*t(l, 2)
      t(l, 3) = per(l)*t(l, 3)
    end do
    turn%lean = 0.0_wp
    do s = 1, 2
      call find_side(t, per, g(:, :, s), merge(-1.0_wp, 1.0_wp, s == 1), away(:, :, s), &
                     turn%turn(:, :, s), turn%lean)
    end do
    !$omp simd
    do l = 1, n_lanes
      turn%cosine(l) = -(away(l, 1, 1)*away(l, 1, 2) + away(l, 2, 1)*away(l, 2, 2) &
                         + away(l, 3, 1)*away(l, 3, 2))
      turn%sine(l) = -(t(l, 1)*(away(l, 2, 1)*away(l, 3, 2) - away(l, 3, 1)*away(l, 2, 2)) &
                       + t(l, 2)*(away(l, 3, 1)*away(l, 1, 2) - away(l, 1, 1)*away(l, 3, 2)) &
                       + t(l, 3)*(away(l, 1, 1)*away(l, 2, 2) - away(l, 2, 1)*away(l, 1, 2)))
    end do
  end subroutine find_turn

  !> Unit vector across the line in a side, and what turns it about the line.
  pure subroutine find_side(t, per_length, g, sign, away, turn, lean)
    real(wp), intent(in) :: t(n_lanes, 3)            !! unit vector along the line
    real(wp), intent(in) :: per_length(n_lanes)      !! one over the length of that tangent
    real(wp), intent(in) :: g(n_lanes, 3)            !! tangent away from the line
    real(wp), intent(in) :: sign                     !! with which the side counts
    real(wp), intent(out) :: away(n_lanes, 3), turn(n_lanes, 3)
    real(wp), intent(inout) :: lean(n_lanes, 3)
    real(wp) :: lift, a1, a2, a3, per, factor
    integer :: l

    !$omp simd private(lift, a1, a2, a3, per, factor)
    do l = 1, n_lanes
      lift = g(l, 1)*t(l, 1) + g(l, 2)*t(l, 2) + g(l, 3)*t(l, 3)
      a1 = g(l, 1) - lift*t(l, 1)
      a2 = g(l, 2) - lift*t(l, 2)
      a3 = g(l, 3) - lift*t(l, 3)
      per = 1.0_wp/sqrt(max(a1**2 + a2**2 + a3**2, tiny(1.0_wp)))   ! nothing at a pole
      away(l, 1) = a1*per
      away(l, 2) = a2*per
      away(l, 3) = a3*per
      factor = sign*per
      lift = lift*per_length(l)
      turn(l, 1) = factor*(t(l, 2)*away(l, 3) - t(l, 3)*away(l, 2))
      turn(l, 2) = factor*(t(l, 3)*away(l, 1) - t(l, 1)*away(l, 3))
      turn(l, 3) = factor*(t(l, 1)*away(l, 2) - t(l, 2)*away(l, 1))
      lean(l, 1) = lean(l, 1) - lift*turn(l, 1)
      lean(l, 2) = lean(l, 2) - lift*turn(l, 2)
      lean(l, 3) = lean(l, 3) - lift*turn(l, 3)
    end do
  end subroutine find_side

  !> Add what a moment at a point of each cell brings to the control points.
  pure subroutine expand(m, along, near, far, turn, moment, force)
    integer, intent(in) :: m
    real(wp), intent(in) :: along(n_lanes, m), near(n_lanes, m, 2), far(n_lanes, m, 2)
    type(turn_t), intent(in) :: turn
    real(wp), intent(in) :: moment(n_lanes)
    real(wp), intent(inout) :: force(n_lanes, m, 3, 3)
    real(wp) :: lean, one, two
    integer :: i, c, l

    do c = 1, 3
      do i = 1, m
        !$omp simd private(lean, one, two)
        do l = 1, n_lanes
          lean = moment(l)*turn%lean(l, c)
          one = moment(l)*turn%turn(l, c, 1)
          two = moment(l)*turn%turn(l, c, 2)
          force(l, i, c, 1) = force(l, i, c, 1) + along(l, i)*lean + near(l, i, 1)*one &
                              + near(l, i, 2)*two
          force(l, i, c, 2) = force(l, i, c, 2) + far(l, i, 1)*one
          force(l, i, c, 3) = force(l, i, c, 3) + far(l, i, 2)*two
        end do
      end do
    end do
  end subroutine expand

  !> Add up the forces on each control point of a part, in the order of the cells.
  pure subroutine scatter(n, n_shares, joints, p, shares, force)
    integer, intent(in) :: n, n_shares
    type(shell_joints_t), intent(in) :: joints
    integer, intent(in) :: p
    real(wp), intent(in) :: shares(n_shares)         !! the forces of the cells
    real(wp), intent(inout) :: force(n, 3)
    real(wp) :: total(3)
    integer :: k, i, step

    step = n_lanes*joints%n_nodes                    ! from one component to the next
    do k = joints%start(p), joints%start(p + 1) - 1
      total = 0.0_wp
      do i = joints%first(k), joints%first(k + 1) - 1
        associate (at => joints%share(i))
          total(1) = total(1) + shares(at)
          total(2) = total(2) + shares(at + step)
          total(3) = total(3) + shares(at + 2*step)
        end associate
      end do
      force(joints%place(k), 1) = force(joints%place(k), 1) + total(1)
      force(joints%place(k), 2) = force(joints%place(k), 2) + total(2)
      force(joints%place(k), 3) = force(joints%place(k), 3) + total(3)
    end do
  end subroutine scatter

  !> As stiff as serves, or less: each spring alone, on the part of the masses that is left to it by
  !! those that share them, has at most this square of an angular frequency.
  subroutine set_stiffness(joints, parts, seams, law, square)
    type(shell_joints_t), intent(inout) :: joints
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: square           !! [1/time^2]
    integer, parameter :: n_passes = 3       ! neighbours that share masses soften each other
    real(wp), allocatable :: bounds(:, :, :)
    real(wp) :: modulus
    integer :: pass

    if (joints%n_cells == 0) return
    modulus = areal_modulus(law%bulk, law%shear) + law%shear     ! E/(1 - nu^2)
    joints%stiffness = modulus*joints%nominal
    do pass = 1, n_passes
      bounds = bounds_of(joints, parts, seams)
      joints%stiffness = joints%stiffness*min(1.0_wp, square/max(bounds, tiny(1.0_wp)))
    end do
    joints%softness = maxval(modulus*joints%nominal/max(joints%stiffness, tiny(1.0_wp)))/firmness
  end subroutine set_stiffness

  !> Bound from above of the square of the largest angular frequency that the springs alone would
  !! have [1/time^2].
  real(wp) function largest_bound(joints, parts, seams)
    type(shell_joints_t), intent(in) :: joints
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams

    largest_bound = 0.0_wp
    if (joints%n_cells > 0) largest_bound = maxval(bounds_of(joints, parts, seams))
  end function largest_bound

  !> Square of the frequency of each spring on its share of the masses: at a control point springs
  !! share as their stiffness times their lever goes (B. M. Irons and G. Treharne, 1971).
  function bounds_of(joints, parts, seams) result(bounds)
    type(shell_joints_t), intent(in) :: joints
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    real(wp), allocatable :: bounds(:, :, :)    !! shape of the stiffness
    real(wp) :: per_mass(size(joints%place))
    real(wp), allocatable :: levers(:, :, :, :, :)
    integer :: q, b, l, row, i

    allocate (bounds, mold=joints%stiffness)
    bounds = 0.0_wp
    levers = levers_of(joints)
    per_mass = sums_of(joints, parts, seams, levers)
    do b = 1, size(bounds, 3)
      do q = 1, joints%n_points
        do row = 1, 3
          do i = 1, joints%n_nodes
            do l = 1, n_lanes
              if (joints%stiffness(l, q, b) > 0.0_wp) bounds(l, q, b) = bounds(l, q, b) &
                + levers(l, i, row, q, b)*per_mass(joints%node(l, i, row, b))
            end do
          end do
        end do
      end do
    end do
  end function bounds_of

  !> Stiffness times lever of all springs at a control point, over the mass there.
  function sums_of(joints, parts, seams, levers) result(per_mass)
    type(shell_joints_t), intent(in) :: joints
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    real(wp), intent(in) :: levers(:, :, :, :, :)
    real(wp) :: per_mass(size(joints%place))
    type(sums_t) :: sums(size(parts))
    type(seams_t) :: shared
    integer :: p, b, l, row, i

    per_mass = 0.0_wp
    do b = 1, size(joints%energies)
      do row = 1, 3
        do i = 1, joints%n_nodes
          do l = 1, n_lanes
            associate (at => per_mass(joints%node(l, i, row, b)))
              at = at + sum(joints%stiffness(l, :, b)*levers(l, i, row, :, b))
            end associate
          end do
        end do
      end do
    end do
    shared = seams
    do p = 1, size(parts)
      allocate (sums(p)%at(size(parts(p)%element%mass)), source=0.0_wp)
      associate (own => joints%place(joints%start(p):joints%start(p + 1) - 1))
        sums(p)%at(own) = per_mass(joints%start(p):joints%start(p + 1) - 1)
      end associate
      call collect(shared, p, size(sums(p)%at), 1, sums(p)%at)
    end do
    call sum_groups(shared, 1)
    do p = 1, size(parts)
      call distribute(shared, p, size(sums(p)%at), 1, sums(p)%at)
      sums(p)%at = sums(p)%at/[parts(p)%element%inertia]
      associate (own => joints%place(joints%start(p):joints%start(p + 1) - 1))
        per_mass(joints%start(p):joints%start(p + 1) - 1) = sums(p)%at(own)
      end associate
    end do
  end function sums_of

  !> By how much the angle at a point changes with the motion of a control point, at most, in the
  !! shape that was gathered last; (8, nodes, rows, points, n_blocks) [1/length].
  function levers_of(joints) result(levers)
    type(shell_joints_t), intent(in) :: joints
    real(wp), allocatable :: levers(:, :, :, :, :)
    real(wp), dimension(n_lanes, joints%n_nodes, 3, 3) :: u, one
    real(wp) :: moment(n_lanes)
    type(turn_t) :: turn
    integer :: q, b

    allocate (levers(n_lanes, joints%n_nodes, 3, joints%n_points, size(joints%energies)))
    moment = 1.0_wp
    do b = 1, size(joints%energies)
      call read_block(joints%n_nodes, size(joints%x, 1), joints%node(:, :, :, b), joints%x, u)
      do q = 1, joints%n_points
        one = 0.0_wp
        associate (m => joints%n_nodes, along => joints%along(:, :, q, b), &
                   near => joints%near(:, :, :, q, b), far => joints%far(:, :, :, q, b))
          call find_turn(m, along, near, far, u, turn)
          call expand(m, along, near, far, turn, moment, one)
        end associate
        levers(:, :, :, q, b) = sqrt(sum(one**2, 3))
      end do
    end do
  end function levers_of

  !> How many joints there are and what they do; empty where there are none.
  pure function joint_words(joints) result(words)
    type(shell_joints_t), intent(in) :: joints
    character(:), allocatable :: words

    words = ""
    if (joints%n_lines == 0) return
    words = "that pass moments: "//to_text(joints%n_lines)//", the softest as "// &
            rounded_text(joints%softness)//" of an element"
    if (joints%n_cells == 0) words = "left as hinges (JOINTS=HINGED): "//to_text(joints%n_lines)
  end function joint_words

  !> State of the springs into a store, or back. Blanks without leave the store as it is.
  subroutine carry_joints(joints, store)
    type(shell_joints_t), intent(inout) :: joints
    type(state_store_t), intent(inout) :: store

    if (joints%n_cells == 0) return
    call carry(store, "energy", joints%energy)
    call carry_field(store, "stiffness", size(joints%stiffness), joints%stiffness)
    call carry_field(store, "rest", size(joints%rest), joints%rest)
  end subroutine carry_joints

end module shell_joints
