!> Joints of shells that pass moments: springs that keep the angle between the two sides of a line
!! at which the mid-surface has no slope in common. docs/shells.md has the formulas.
module shell_joints
  use kinds, only: wp
  use text, only: to_text
  use state_store, only: state_store_t, carry, carry_field
  use knot_vector, only: max_degree
  use block_law, only: block_law_t
  use basis_tables, only: n_lanes
  use patch_seams, only: seams_t, collect, sum_groups, distribute
  use element, only: part_t, force_report_t
  implicit none
  private

  public :: add_joint_forces, set_rest, set_stiffness, largest_bound, joint_words, carry_joints

  integer, parameter, public :: most_nodes = max_degree + 1   !! of a row of an element

  !> Springs, eight elements of lines side by side; lanes that fill the last block up have no
  !! stiffness. Rows 1 to 3 of an element: the line, and the next row of either side.
  type, public :: shell_joints_t
    integer :: n_lines = 0, n_cells = 0      !! a cell: an element of a line
    integer :: n_nodes = 0, n_points = 0     !! of a row, of a cell; most of all lines
    integer, allocatable :: part(:, :)       !! of the rows, shape (3, n_cells)
    integer, allocatable :: place(:, :, :)   !! control points (nodes, 3, n_cells), axis 1 fastest
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
    real(wp) :: energy = 0.0_wp                    !! stored now
    real(wp), allocatable :: forces(:, :, :, :, :) !! of the cells (8, nodes, 3, 3 rows, n_blocks)
    real(wp), allocatable :: energies(:)           !! of the blocks
  end type shell_joints_t

  !> How the sides turn: the change of the angle is the sum of `turn(side)` times the motion of the
  !! tangents away from the line, and of `lean` times that of the tangent along it.
  type :: turn_t
    real(wp) :: cosine(n_lanes), sine(n_lanes)     !! of the angle
    real(wp) :: turn(n_lanes, 3, 2), lean(n_lanes, 3)
  end type turn_t

  !> A sum over springs at each control point of a part, over the mass there.
  type :: sums_t
    real(wp), allocatable :: per_mass(:)
  end type sums_t

contains

  !> Set the angles of the present shape as those to be kept.
  subroutine set_rest(joints, parts)
    type(shell_joints_t), intent(inout) :: joints
    type(part_t), intent(in) :: parts(:)
    real(wp) :: u(n_lanes, most_nodes, 3, 3)
    type(turn_t) :: turn
    integer :: q, b

    do b = 1, size(joints%energies)
      call gather(joints, parts, 0.0_wp, b, u)
      do q = 1, joints%n_points
        turn = turn_of(joints, u, q, b)
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
    integer :: b

    if (joints%n_cells == 0) return
    ahead = merge(dt, 0.0_wp, is_trial)
    !$omp parallel do schedule(static) if (size(joints%energies) > worth)
    do b = 1, size(joints%energies)
      call work_block(joints, parts, ahead, b)
    end do
    !$omp end parallel do
    call scatter(joints, parts)
    if (is_trial) return
    before = joints%energy
    joints%energy = sum(joints%energies)
    report%internal_work = report%internal_work + joints%energy - before
  end subroutine add_joint_forces

  !> Forces and energy of a block.
  subroutine work_block(joints, parts, ahead, b)
    type(shell_joints_t), intent(inout) :: joints
    type(part_t), intent(in) :: parts(:)
    real(wp), intent(in) :: ahead          !! time to which positions are carried on [time]
    integer, intent(in) :: b
    real(wp) :: u(n_lanes, most_nodes, 3, 3), moment(n_lanes), s(n_lanes), c(n_lanes)
    type(turn_t) :: turn
    integer :: q

    call gather(joints, parts, ahead, b, u)
    joints%energies(b) = 0.0_wp
    joints%forces(:, :, :, :, b) = 0.0_wp
    do q = 1, joints%n_points
      turn = turn_of(joints, u, q, b)
      associate (rest => joints%rest(:, :, q, b))
        s = turn%sine*rest(:, 1) - turn%cosine*rest(:, 2)
        c = turn%cosine*rest(:, 1) + turn%sine*rest(:, 2)
      end associate
      moment = joints%stiffness(:, q, b)*s
      ! 1 - c, without the loss of digits at small angles
      joints%energies(b) = joints%energies(b) + sum(joints%stiffness(:, q, b) &
        *merge(s**2/(1.0_wp + max(c, 0.0_wp)), 1.0_wp - c, c > 0.0_wp))
      call expand(joints, turn, moment, q, b, joints%forces(:, :, :, :, b))
    end do
  end subroutine work_block

  !> Positions of the control points of a block, from the first of each cell's line on.
  subroutine gather(joints, parts, ahead, b, u)
    type(shell_joints_t), intent(in) :: joints
    type(part_t), intent(in) :: parts(:)
    real(wp), intent(in) :: ahead
    integer, intent(in) :: b
    real(wp), intent(out) :: u(n_lanes, most_nodes, 3, 3)
    integer :: l, row, cell, i, c

    do l = 1, n_lanes
      cell = min(n_lanes*(b - 1) + l, joints%n_cells)
      do row = 1, 3
        associate (motion => parts(joints%part(row, cell))%element%motion)
          call pick(size(motion%x)/3, joints%n_nodes, joints%place(:, row, cell), ahead, motion%x, &
                    motion%v, u(l, :, :, row))
        end associate
      end do
    end do
    do row = 3, 1, -1
      do c = 1, 3
        do i = joints%n_nodes, 1, -1
          u(:, i, c, row) = u(:, i, c, row) - u(:, 1, c, 1)
        end do
      end do
    end do
  end subroutine gather

  pure subroutine pick(n, m, places, ahead, x, v, u)
    integer, intent(in) :: n, m, places(m)
    real(wp), intent(in) :: ahead, x(n, 3), v(n, 3)
    real(wp), intent(inout) :: u(:, :)

    u(:m, :) = x(places, :)
    if (ahead > 0.0_wp) u(:m, :) = u(:m, :) + ahead*v(places, :)
  end subroutine pick

  !> The angle at a point of each cell of a block, and how it changes.
  pure function turn_of(joints, u, q, b) result(turn)
    type(shell_joints_t), intent(in) :: joints
    real(wp), intent(in) :: u(n_lanes, most_nodes, 3, 3)
    integer, intent(in) :: q, b
    type(turn_t) :: turn
    real(wp) :: t(n_lanes, 3), g(n_lanes, 3, 2), away(n_lanes, 3, 2)
    integer :: i, c, s

    t = 0.0_wp
    g = 0.0_wp
    do c = 1, 3
      do i = 1, joints%n_nodes
        t(:, c) = t(:, c) + joints%along(:, i, q, b)*u(:, i, c, 1)
        do s = 1, 2
          g(:, c, s) = g(:, c, s) + joints%near(:, i, s, q, b)*u(:, i, c, 1) &
                       + joints%far(:, i, s, q, b)*u(:, i, c, 1 + s)
        end do
      end do
    end do
    turn%lean = 0.0_wp
    do s = 1, 2
      call side_turn(t, g(:, :, s), merge(-1.0_wp, 1.0_wp, s == 1), away(:, :, s), &
                     turn%turn(:, :, s), turn%lean)
    end do
    associate (a => away(:, :, 1), d => away(:, :, 2))
      turn%cosine = -(a(:, 1)*d(:, 1) + a(:, 2)*d(:, 2) + a(:, 3)*d(:, 3))
      turn%sine = -(t(:, 1)*(a(:, 2)*d(:, 3) - a(:, 3)*d(:, 2)) &
                    + t(:, 2)*(a(:, 3)*d(:, 1) - a(:, 1)*d(:, 3)) &
                    + t(:, 3)*(a(:, 1)*d(:, 2) - a(:, 2)*d(:, 1))) &
                  /sqrt(t(:, 1)**2 + t(:, 2)**2 + t(:, 3)**2)
    end associate
  end function turn_of

  !> Unit vector across the line in a side, and what turns it about the line.
  pure subroutine side_turn(t, g, sign, away, turn, lean)
    real(wp), intent(in) :: t(n_lanes, 3), g(n_lanes, 3)   !! tangents along the line, away from it
    real(wp), intent(in) :: sign                           !! with which the side counts
    real(wp), intent(out) :: away(n_lanes, 3), turn(n_lanes, 3)
    real(wp), intent(inout) :: lean(n_lanes, 3)
    real(wp) :: per_tt, lift, a1, a2, a3, per, factor
    integer :: l

    !$omp simd private(per_tt, lift, a1, a2, a3, per, factor)
    do l = 1, n_lanes
      per_tt = 1.0_wp/(t(l, 1)**2 + t(l, 2)**2 + t(l, 3)**2)
      lift = (g(l, 1)*t(l, 1) + g(l, 2)*t(l, 2) + g(l, 3)*t(l, 3))*per_tt
      a1 = g(l, 1) - lift*t(l, 1)
      a2 = g(l, 2) - lift*t(l, 2)
      a3 = g(l, 3) - lift*t(l, 3)
      per = 1.0_wp/sqrt(max(a1**2 + a2**2 + a3**2, tiny(1.0_wp)))   ! nothing at a pole
      away(l, 1) = a1*per
      away(l, 2) = a2*per
      away(l, 3) = a3*per
      factor = sign*per*sqrt(per_tt)
      turn(l, 1) = factor*(t(l, 2)*away(l, 3) - t(l, 3)*away(l, 2))
      turn(l, 2) = factor*(t(l, 3)*away(l, 1) - t(l, 1)*away(l, 3))
      turn(l, 3) = factor*(t(l, 1)*away(l, 2) - t(l, 2)*away(l, 1))
      lean(l, 1) = lean(l, 1) - lift*turn(l, 1)
      lean(l, 2) = lean(l, 2) - lift*turn(l, 2)
      lean(l, 3) = lean(l, 3) - lift*turn(l, 3)
    end do
  end subroutine side_turn

  !> Add what a moment at a point of each cell brings to the control points.
  pure subroutine expand(joints, turn, moment, q, b, force)
    type(shell_joints_t), intent(in) :: joints
    type(turn_t), intent(in) :: turn
    real(wp), intent(in) :: moment(n_lanes)
    integer, intent(in) :: q, b
    real(wp), intent(inout) :: force(:, :, :, :)
    integer :: i, c, s

    do c = 1, 3
      do i = 1, joints%n_nodes
        force(:, i, c, 1) = force(:, i, c, 1) + moment*(joints%along(:, i, q, b)*turn%lean(:, c) &
          + joints%near(:, i, 1, q, b)*turn%turn(:, c, 1) &
          + joints%near(:, i, 2, q, b)*turn%turn(:, c, 2))
        do s = 1, 2
          force(:, i, c, 1 + s) = force(:, i, c, 1 + s) &
                                  + moment*joints%far(:, i, s, q, b)*turn%turn(:, c, s)
        end do
      end do
    end do
  end subroutine expand

  !> Forces of all cells in their order onto the internal forces. Those on the line go to the patch
  !! of its first side: what meets at seams is summed up afterwards.
  subroutine scatter(joints, parts)
    type(shell_joints_t), intent(in) :: joints
    type(part_t), intent(inout) :: parts(:)
    integer :: cell, row, l, b

    do cell = 1, joints%n_cells
      b = (cell - 1)/n_lanes + 1
      l = cell - n_lanes*(b - 1)
      do row = 1, 3
        associate (f => parts(joints%part(row, cell))%element%motion%internal_force)
          call put(size(f)/3, joints%n_nodes, joints%place(:, row, cell), &
                   joints%forces(l, :, :, row, b), f)
        end associate
      end do
    end do
  end subroutine scatter

  !> Places that fill a shorter row up repeat one with a force of zero.
  pure subroutine put(n, m, places, f, force)
    integer, intent(in) :: n, m, places(m)
    real(wp), intent(in) :: f(:, :)
    real(wp), intent(inout) :: force(n, 3)
    integer :: i, c

    do c = 1, 3
      do i = 1, m
        force(places(i), c) = force(places(i), c) + f(i, c)
      end do
    end do
  end subroutine put

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
    integer :: pass

    if (joints%n_cells == 0) return
    associate (k => law%bulk, g => law%shear)
      joints%stiffness = 4.0_wp*g*(3.0_wp*k + g)/(3.0_wp*k + 4.0_wp*g)*joints%nominal
    end associate
    do pass = 1, n_passes
      bounds = bounds_of(joints, parts, seams)
      joints%stiffness = joints%stiffness*min(1.0_wp, square/max(bounds, tiny(1.0_wp)))
    end do
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
    type(sums_t) :: sums(size(parts))
    real(wp), allocatable :: levers(:, :, :, :, :)
    integer :: q, b, l, cell, row, i

    bounds = 0.0_wp*joints%stiffness
    levers = levers_of(joints, parts)
    sums = sums_of(joints, parts, seams, levers)
    do b = 1, size(bounds, 3)
      do q = 1, joints%n_points
        do l = 1, n_lanes
          cell = n_lanes*(b - 1) + l
          if (cell > joints%n_cells) cycle
          do row = 1, 3
            do i = 1, joints%n_nodes
              bounds(l, q, b) = bounds(l, q, b) + levers(l, i, row, q, b) &
                *sums(joints%part(row, cell))%per_mass(joints%place(i, row, cell))
            end do
          end do
        end do
      end do
    end do
  end function bounds_of

  !> Stiffness times lever of all springs at a control point over the mass there, by part.
  function sums_of(joints, parts, seams, levers) result(sums)
    type(shell_joints_t), intent(in) :: joints
    type(part_t), intent(in) :: parts(:)
    type(seams_t), intent(in) :: seams
    real(wp), intent(in) :: levers(:, :, :, :, :)
    type(sums_t) :: sums(size(parts))
    type(seams_t) :: shared
    integer :: p, b, l, cell, row, i

    do p = 1, size(parts)
      allocate (sums(p)%per_mass(size(parts(p)%element%mass)), source=0.0_wp)
    end do
    do cell = 1, joints%n_cells
      b = (cell - 1)/n_lanes + 1
      l = cell - n_lanes*(b - 1)
      do row = 1, 3
        do i = 1, joints%n_nodes
          associate (at => sums(joints%part(row, cell))%per_mass(joints%place(i, row, cell)))
            at = at + sum(joints%stiffness(l, :, b)*levers(l, i, row, :, b))
          end associate
        end do
      end do
    end do
    shared = seams
    do p = 1, size(parts)
      call collect(shared, p, size(sums(p)%per_mass), 1, sums(p)%per_mass)
    end do
    call sum_groups(shared, 1)
    do p = 1, size(parts)
      call distribute(shared, p, size(sums(p)%per_mass), 1, sums(p)%per_mass)
      sums(p)%per_mass = sums(p)%per_mass/[parts(p)%element%inertia]
    end do
  end function sums_of

  !> By how much the angle at a point changes with the motion of a control point, at most; (8,
  !! nodes, rows, points, n_blocks) [1/length].
  function levers_of(joints, parts) result(levers)
    type(shell_joints_t), intent(in) :: joints
    type(part_t), intent(in) :: parts(:)
    real(wp), allocatable :: levers(:, :, :, :, :)
    real(wp) :: u(n_lanes, most_nodes, 3, 3), one(n_lanes, joints%n_nodes, 3, 3), moment(n_lanes)
    integer :: q, b

    allocate (levers(n_lanes, joints%n_nodes, 3, joints%n_points, size(joints%energies)))
    moment = 1.0_wp
    do b = 1, size(joints%energies)
      call gather(joints, parts, 0.0_wp, b, u)
      do q = 1, joints%n_points
        one = 0.0_wp
        call expand(joints, turn_of(joints, u, q, b), moment, q, b, one)
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
    words = "that pass moments: "//to_text(joints%n_lines)
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
